// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdint>
#include <string>

#include "arrays.h"
#include "gil.h"
#include "sinew/binding.h"
#include "sinew/mesh/crossings.h"

namespace sinew::bindings {
namespace {

py::array_t<std::int32_t> crossing(const ArrayLike& points, const ArrayLike& triangles,
                                   const py::object& groups, const Threads& threads) {
    const auto of_points = checked_rows<double>(points, "points", 3, "float64 [vertices, 3]", kMaxVertices);
    const auto corners =
        checked_rows<std::int32_t>(triangles, "triangles", 3, "int32 [triangles, 3]", kMaxVertices);
    const auto of_groups =
        one_for_each<std::int32_t>(groups, "groups", static_cast<std::size_t>(corners.shape(0)), "int32");
    const std::size_t most = checked_threads(threads);
    const std::span all = as_span(corners);
    const auto count = of_points.shape(0);
    for (const std::int32_t vertex : all) {
        if (vertex >= 0 && vertex < count) continue;
        fail("triangles", "vertices from 0 to " + std::to_string(count - 1), std::to_string(vertex));
    }
    const std::span places(reinterpret_cast<const Vec3<double>*>(of_points.data()),
                           static_cast<std::size_t>(count));
    const std::span each(reinterpret_cast<const std::array<std::int32_t, 3>*>(all.data()), all.size() / 3);
    std::vector<std::array<std::int32_t, 2>> found;
    without_gil([&] { found = crossing_triangles(places, each, as_span(of_groups), most); });
    py::array_t<std::int32_t> pairs({static_cast<py::ssize_t>(found.size()), py::ssize_t{2}});
    std::ranges::copy(found, reinterpret_cast<std::array<std::int32_t, 2>*>(pairs.mutable_data()));
    return pairs;
}

}  // namespace

void bind_crossings(py::module_& m) {
    m.def(
        "crossing_triangles", &crossing, "points"_a, "triangles"_a, "groups"_a = py::none(),
        "threads"_a = py::none(),
        R"(Pairs of triangles of a surface that cross, int32 [pairs, 2]: an edge of one meets the other, and they
share no vertex. The lower index comes first, and pairs ascend. Triangles in one plane do not cross, nor do those of
points that are NaN.

points: float64 [vertices, 3].
triangles: int32 [triangles, 3].
groups: int32 [triangles]; two of one group do not count, as where one bone moves both. Below 0: of none.)");
}

}  // namespace sinew::bindings
