// SPDX-License-Identifier: GPL-3.0-or-later
// Optimised centres of rotation on lanes. Rows are those of CentreRows. The vertex data is the centre: x, y, z.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/cor/cor.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"
#include "sinew/methods/centre_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/cor/cor.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/centre-inl.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct CorKernel : CentreRows {
    static constexpr std::size_t kVertexFloats = 3;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// data  the centre's x, y and z, kLanes apart, in model space; if null, each vertex is its own centre
    template <class D>
    static HWY_INLINE Points<D> centre(D d, const float* data, const float* bones_from_model,
                                       const Points<D>& p) {
        if (data == nullptr) return p;
        const Points<D> c{hn::Load(d, data), hn::Load(d, data + kLanes), hn::Load(d, data + 2 * kLanes)};
        return bones_from_model == nullptr ? c : displaced(d, bones_from_model, c);
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Motion<D>& motion, const Points<D>& centre,
                                       const Points<D>& p) {
        const Points<D> from_centre = subtract<D>(p, centre);
        return add<D>(p, add_rotation<D>(d, motion.displacement, motion.rotation, from_centre));
    }
};

void deform_cor(const Frame& frame, std::size_t begin, std::size_t end) {
    deform_rigid<CorKernel>(frame, begin, end);
}

void prepare_cor(std::span<const std::int32_t> used, std::span<const Affine<float>> posed_from_rest,
                 Palette& palette) {
    prepare_rigid<CorKernel>(used, posed_from_rest, palette);
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {
namespace {

constexpr Kernel kKernel{kCentreRestRow, true, 0, prepare_rigid_method<Cor, write_centre_bone>,
                         SINEW_TARGETS(deform_cor, prepare_cor)};

}  // namespace

const Kernel& Cor::kernel() noexcept { return kKernel; }

}  // namespace sinew

#endif
