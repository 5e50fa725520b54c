// SPDX-License-Identifier: GPL-3.0-or-later
// Optimised centres of rotation on lanes. Rows are those of CentreRows. The vertex data is the centre: x, y, z.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/skinning/cor.h"

#include "sinew/deform/centre_rows.h"
#include "sinew/deform/rigid_bones.h"
#include "sinew/deform/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/deform/kernels/cor.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/deform/centre-inl.h"
#include "sinew/deform/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct CorKernel : CentreRows {
    static constexpr std::size_t kVertexFloats = 3;
    static constexpr std::size_t kSignedFloat4s = 1;

    /// centre  x, y and z, kLanes apart, in model space; if null, each vertex is its own centre
    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Sum<D, kNumbers>& sum, const Points<D>& p,
                                       const float* centre, const float* bones_from_model) {
        Points<D> c = p;
        if (centre != nullptr) {
            c = {hn::Load(d, centre), hn::Load(d, centre + kLanes), hn::Load(d, centre + 2 * kLanes)};
            if (bones_from_model != nullptr) c = displaced(d, bones_from_model, c);
        }
        const auto moved = [&](std::size_t row) HWY_ATTR {
            const Vec<D>* const m = sum.value + row;
            return hn::MulAdd(m[0], c.x, hn::MulAdd(m[1], c.y, hn::MulAdd(m[2], c.z, m[3])));
        };
        const Points<D> from_centre{hn::Sub(p.x, c.x), hn::Sub(p.y, c.y), hn::Sub(p.z, c.z)};
        const Points<D> displacement =
            add_rotation<D>(d, {moved(4), moved(8), moved(12)}, sum.value, from_centre);
        return add<D>(p, displacement);
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
