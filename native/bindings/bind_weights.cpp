// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>

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

using Numbers = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;
using Weights = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// Whether the vertices have just these entries.
bool are_same(std::span<const BlenderVertex> vertices, const Numbers& counts, const Numbers& groups,
              const Weights& weights) {
    if (counts.size() != static_cast<py::ssize_t>(vertices.size()) || groups.size() != weights.size())
        return false;
    const std::int32_t* count_of = counts.data();
    std::span left_groups(groups.data(), static_cast<std::size_t>(groups.size()));
    const float* weight_of = weights.data();
    for (const BlenderVertex& vertex : vertices) {
        const auto count = static_cast<std::size_t>(vertex.count);
        if (vertex.count != *count_of++ || count > left_groups.size()) return false;
        if (count > 0 && vertex.weights == nullptr) return false;
        for (std::size_t i = 0; i < count; ++i) {
            const BlenderWeight& each = vertex.weights[i];
            if (static_cast<std::int32_t>(each.group) != left_groups[i] || each.weight != *weight_of++)
                return false;
        }
        left_groups = left_groups.subspan(count);
    }
    return left_groups.empty();
}

py::tuple weights_in_memory(std::uintptr_t address, std::size_t vertex_count,
                            const std::optional<std::tuple<Numbers, Numbers, Weights>>& known) {
    if (address == 0 || address % alignof(BlenderVertex) != 0) {
        fail("address", "that of an MDeformVert", std::to_string(address));
    }
    const std::span vertices(reinterpret_cast<const BlenderVertex*>(address), vertex_count);
    if (known && std::apply([&](const auto&... each) { return are_same(vertices, each...); }, *known)) {
        return py::cast(*known);
    }
    Numbers counts(static_cast<py::ssize_t>(vertex_count));
    std::int32_t* count_of = counts.mutable_data();
    py::ssize_t total = 0;
    for (const BlenderVertex& vertex : vertices) {
        if (vertex.count < 0 || (vertex.count > 0 && vertex.weights == nullptr)) {
            fail("address", "that of an MDeformVert", "other memory");
        }
        *count_of++ = vertex.count;
        total += vertex.count;
    }
    Numbers groups(total);
    Weights weights(total);
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
        py::arg("known") = py::none(),
        R"(The vertex groups of a mesh, read from the memory of the Blender that this runs in: int32 [vertices], how
many entries each vertex has; int32 [entries], the group of each, in the order of the vertices and as stored; float32
[entries], its weight. ValueError where this can be no such memory.

address   of the mesh's MDeformVert array, one for each vertex; a wrong one crashes the process or gives garbage
vertices  how many
known     what this returned before: these very arrays are returned where the memory still has the same)");
}

}  // namespace sinew::bindings
