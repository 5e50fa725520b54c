// SPDX-License-Identifier: GPL-3.0-or-later
// Optimised centres of rotation on lanes. Rows are those of CentreRows. The vertex data is the centre: x, y, z.
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/cor/cor.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/cor/cor.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

struct CorKernel : CentreRows {
    static constexpr std::size_t kSignedFloat4s = 1;

    /// Without vertex data, each vertex is its own centre.
    template <class D>
    static HWY_INLINE Points<D> centre(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                                       std::size_t lane, const Points<D>& p) {
        const float* const data = vertex_rows_of<Cor::info.vertex_floats>(pointers, b, lane);
        if (data == nullptr) return p;
        return to_bones(d, spaces, load_row_points(d, data));
    }

    template <class D>
    static HWY_INLINE Points<D> finish(D d, const Motion<D>& motion, const Points<D>& centre,
                                       const Points<D>& p) {
        const Points<D> from_centre = subtract<D>(p, centre);
        return add<D>(p, add_rotation<D>(d, motion.displacement, motion.rotation, from_centre));
    }
};

namespace {

SINEW_RIGID_FUNCTIONS(CorKernel)

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sinew {

SINEW_KERNEL(Cor, .rest_row = kCentreRestRow, .signed_float4s = 1, .bone_rows = SINEW_TARGETS(bone_rows),
             .scaled_bone_rows = scaled_bone_rows<Cor, kCentreRestRow, write_centre_bone>,
             .pack_vertex_data = VertexNumbers<Cor::info.vertex_floats>::pack)

}  // namespace sinew
#endif
