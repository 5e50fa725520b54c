// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <string>

#include "arrays.h"
#include "signatures.h"

namespace sinew::bindings {
namespace {

// MDeformWeight and MDeformVert of Blender 4.2 to 5.3.
struct BlenderWeight {
    std::uint32_t group;
    float weight;
};
struct BlenderVertex {
    const BlenderWeight* weights;
    std::int32_t count;
    std::int32_t flag;
};
static_assert(sizeof(BlenderWeight) == 8 && sizeof(BlenderVertex) == 16);

py::tuple weights_in_memory(std::uintptr_t address, std::size_t vertex_count) {
    if (address == 0 || address % alignof(BlenderVertex) != 0) {
        fail("address", "that of an MDeformVert", std::to_string(address));
    }
    const std::span vertices(reinterpret_cast<const BlenderVertex*>(address), vertex_count);
    py::array_t<std::int32_t> counts(static_cast<py::ssize_t>(vertex_count));
    std::int32_t* count_of = counts.mutable_data();
    py::ssize_t total = 0;
    for (const BlenderVertex& vertex : vertices) {
        if (vertex.count < 0 || (vertex.count > 0 && vertex.weights == nullptr)) {
            fail("address", "that of an MDeformVert", "other memory");
        }
        *count_of++ = vertex.count;
        total += vertex.count;
    }
    py::array_t<std::int32_t> groups(total);
    py::array_t<float> weights(total);
    std::int32_t* group_of = groups.mutable_data();
    float* weight_of = weights.mutable_data();
    for (const BlenderVertex& vertex : vertices) {
        for (const BlenderWeight& each : std::span(vertex.weights, static_cast<std::size_t>(vertex.count))) {
            *group_of++ = static_cast<std::int32_t>(each.group);
            *weight_of++ = each.weight;
        }
    }
    return py::make_tuple(counts, groups, weights);
}

}  // namespace

void bind_weights(py::module_& m) {
    m.def(
        "weights_in_memory", weights_in_memory, py::arg("address"), py::arg("vertices"),
        R"(The vertex groups of a mesh, read from the memory of the Blender that this runs in: int32 [vertices], how
many entries each vertex has; int32 [entries], the group of each, in the order of the vertices and as stored; float32
[entries], its weight. ValueError where this can be no such memory.

address   of the mesh's MDeformVert array, one for each vertex; a wrong one crashes the process or gives garbage
vertices  how many)");
}

}  // namespace sinew::bindings
