// SPDX-License-Identifier: GPL-3.0-or-later
// Optimised centres of rotation on lanes. Rows are those of CentreRows. The vertex data is the centre: x, y, z.
#include "sinew/methods/cor/cor.h"

#define SINEW_THIS_FILE "sinew/methods/cor/cor.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

struct CorKernel : CentreRows, RigidFunctions<Cor, CorKernel> {
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

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Cor, CorKernel, .pack_vertex_data = VertexNumbers<Cor::info.vertex_floats>::pack)
