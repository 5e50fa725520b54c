// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <string>

#include "arrays.h"
#include "signatures.h"

namespace sinew::bindings {
namespace {

// Blender's structures MDeformWeight and MDeformVert (4.2 to 5.3).
struct Entry {
    std::uint32_t group;
    float weight;
};
struct Vertex {
    const Entry* entries;
    std::int32_t count;
    std::int32_t flag;
};
static_assert(sizeof(Entry) == 8 && sizeof(Vertex) == 16);

py::tuple weights_in_memory(std::uintptr_t address, std::size_t vertex_count) {
    if (address == 0 || address % alignof(Vertex) != 0) {
        fail("address", "that of a MDeformVert", std::to_string(address));
    }
    const std::span vertices(reinterpret_cast<const Vertex*>(address), vertex_count);
    py::array_t<std::int32_t> counts(static_cast<py::ssize_t>(vertex_count));
    std::int32_t* count_of = counts.mutable_data();
    py::ssize_t total = 0;
    for (const Vertex& vertex : vertices) {
        *count_of++ = vertex.count;
        total += vertex.count;
    }
    py::array_t<std::int32_t> groups(total);
    py::array_t<float> weights(total);
    std::int32_t* group_of = groups.mutable_data();
    float* weight_of = weights.mutable_data();
    for (const Vertex& vertex : vertices) {
        for (const Entry& entry : std::span(vertex.entries, static_cast<std::size_t>(vertex.count))) {
            *group_of++ = static_cast<std::int32_t>(entry.group);
            *weight_of++ = entry.weight;
        }
    }
    return py::make_tuple(counts, groups, weights);
}

}  // namespace

void bind_weights(py::module_& m) {
    m.def("weights_in_memory", weights_in_memory, py::arg("address"), py::arg("vertices"),
          R"(Read the vertex groups of a mesh from the memory of Blender, in whose process this runs.

Args:
    address: that of the first of the mesh's MDeformVert, as many as it has vertices. Nothing can check it: with
        another one the process crashes.
    vertices: how many.

Returns:
    int32 [vertices], the entries of each vertex; int32 [entries], the group of each, in the order of the
    vertices and as stored; float32 [entries], its weight.

Raises:
    ValueError: the address is 0, or not aligned.)");
}

}  // namespace sinew::bindings
