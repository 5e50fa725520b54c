// SPDX-License-Identifier: GPL-3.0-or-later
// Quaternion-vector blending on lanes. A row is the rotation (w, x, y, z), then the translation (x, y, z, 0).
#include "sinew/methods/qv/qv.h"

#define SINEW_THIS_FILE "sinew/methods/qv/qv.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

struct QvKernel : TranslatedRows<kRow, 4, 1>, RigidFunctions<Qv, QvKernel> {
    static constexpr std::size_t kSignedFloat4s = 1;

    static HWY_INLINE void write_row(const Quats& rotation, const BonePoints& translation, BoneVec* row) {
        row[0] = rotation.w;
        row[1] = rotation.v.x;
        row[2] = rotation.v.y;
        row[3] = rotation.v.z;
        row[4] = translation.x;
        row[5] = translation.y;
        row[6] = translation.z;
        row[7] = hn::Zero(BoneTag());
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D>& sum, const Points<D>& p) {
        const Vec<D>* const q = sum.value;
        const Points<D> rotated = add_rotation<D>(d, p, q, p);
        return {hn::Add(rotated.x, q[4]), hn::Add(rotated.y, q[5]), hn::Add(rotated.z, q[6])};
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Qv, QvKernel)
