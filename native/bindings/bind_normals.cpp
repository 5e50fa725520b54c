// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/numpy.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "arrays.h"
#include "gil.h"
#include "sinew/normals.h"

namespace sinew::bindings {
namespace {

// In the order of NormalDomain.
constexpr std::array<std::string_view, 3> kDomains{"vertex", "corner", "face"};
using Domain = Typed<"typing.Literal['vertex', 'corner', 'face']">;
using OptionalDomain = Typed<"typing.Literal['vertex', 'corner', 'face'] | None">;

/// Flags: all numbers except 0 are set. None gives an empty array.
std::vector<std::uint8_t> checked_flags(const py::object& value, const char* argument,
                                        const std::string& wanted) {
    if (value.is_none()) return {};
    const auto flags = checked<float>(value, argument, 1, wanted);
    std::vector<std::uint8_t> result(static_cast<std::size_t>(flags.size()));
    std::ranges::transform(as_span(flags), result.begin(),
                           [](float flag) { return static_cast<std::uint8_t>(flag != 0.0f); });
    return result;
}

/// Custom normals. None gives an empty array.
std::vector<std::int16_t> checked_custom(const py::object& value) {
    if (value.is_none()) return {};
    const auto numbers = checked_rows<std::int32_t>(value, "custom_normals", 2, "None or int16 [corners, 2]");
    std::vector<std::int16_t> result;
    result.reserve(static_cast<std::size_t>(numbers.size()));
    for (const std::int32_t number : as_span(numbers)) {
        if (!std::in_range<std::int16_t>(number)) {
            fail("custom_normals", "numbers that int16 holds", std::to_string(number));
        }
        result.push_back(static_cast<std::int16_t>(number));
    }
    return result;
}

NormalDomain checked_domain(const Timed<Normals>& normals, const py::object& value) {
    if (value.is_none()) return normals.domain();
    return static_cast<NormalDomain>(checked_choice(value, "domain", kDomains));
}

std::string name_of(NormalDomain domain) { return std::string(kDomains[static_cast<std::size_t>(domain)]); }

Timed<Normals> make(const Index& vertex_count, const ArrayLike& face_offsets,
                    const ArrayLike& corner_vertices, const OptionalArrayLike& edges,
                    const OptionalArrayLike& sharp_edges, const OptionalArrayLike& sharp_faces,
                    const OptionalArrayLike& custom_normals) {
    const std::size_t vertices =
        checked_integer(vertex_count, "vertex_count",
                        "an integer from 0 to " + std::to_string(kMaxNormalVertices), kMaxNormalVertices);
    const auto offsets = checked<std::int32_t>(face_offsets, "face_offsets", 1, "int32 [faces + 1]");
    const auto corners = checked<std::int32_t>(corner_vertices, "corner_vertices", 1, "int32 [corners]");
    py::array_t<std::int32_t> ends;
    if (!edges.is_none()) ends = checked_rows<std::int32_t>(edges, "edges", 2, "int32 [edges, 2]");
    const auto of_edges = checked_flags(sharp_edges, "sharp_edges", "None or bool [edges]");
    const auto of_faces = checked_flags(sharp_faces, "sharp_faces", "None or bool [faces]");
    const auto custom = checked_custom(custom_normals);
    return Normals({as_span(offsets), as_span(corners), as_span(ends)}, vertices,
                   {of_edges, of_faces, custom});
}

py::array_t<float> compute(const Timed<Normals>& normals, const ArrayLike& points,
                           const OptionalDomain& domain, const Out& out, const Threads& threads) {
    const auto given = checked_points(points, "points", normals.count(NormalDomain::vertex));
    const NormalDomain wanted = checked_domain(normals, domain);
    const std::size_t most = checked_threads(threads);
    py::array_t<float> result = checked_out(out, normals.count(wanted));
    check_apart(result, given);
    const auto to = as_points_to_write(result);
    normals.call([&] { return normals.compute(wanted, as_points(given), to, most); });
    return result;
}

std::string text_of(const Timed<Normals>& normals) {
    return "<sinew.Normals: " + std::to_string(normals.count(NormalDomain::vertex)) + " vertices, " +
           std::to_string(normals.count(NormalDomain::face)) + " faces, domain " + name_of(normals.domain()) +
           ">";
}

}  // namespace

void bind_normals(py::module_& m) {
    const auto count_of = [](NormalDomain domain) {
        return [domain](const Timed<Normals>& normals) { return normals.count(domain); };
    };
    py::class_<Timed<Normals>>(
        m, "Normals",
        R"(Normals of a mesh that deforms, as Blender defines them: of faces by Newell's method, of vertices weighted
by the angles of corners, of corners by fans between sharp edges.)")
        .def(py::init(&make), "vertex_count"_a, "face_offsets"_a, "corner_vertices"_a, "edges"_a = py::none(),
             py::kw_only(), "sharp_edges"_a = py::none(), "sharp_faces"_a = py::none(),
             "custom_normals"_a = py::none(),
             R"(vertex_count: number of vertices, at most 2^29 - 1.
face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
corner_vertices: int32 [corners], the vertex of each corner; at most 2^28 - 1.
edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces; None if nothing is
    sharp or custom.
sharp_edges: None, or bool [edges].
sharp_faces: None, or bool [faces], which are flat.
custom_normals: None, or int16 [corners, 2], as in Blender's attribute custom_normal.)")
        .def_property_readonly(
            "domain",
            [](const Timed<Normals>& normals) -> Domain { return py::str(name_of(normals.domain())); },
            R"(The simplest domain that describes the mesh's shading, as Blender's Mesh.normals_domain: "face" if every
face is flat or every edge sharp, else "corner" if anything is sharp, else "vertex". With custom normals always
"corner".)")
        .def_property_readonly("vertex_count", count_of(NormalDomain::vertex), kVertexCount)
        .def_property_readonly("corner_count", count_of(NormalDomain::corner), "Number of corners of faces.")
        .def_property_readonly("face_count", count_of(NormalDomain::face), "Number of faces.")
        .def("__repr__", &text_of)
        .def("compute", &compute, "points"_a, "domain"_a = py::none(), "out"_a = py::none(),
             "threads"_a = py::none(),
             R"(Unit vectors, float32 [vertices, corners or faces, 3].

points: float32 [vertices, 3], deformed.
domain: "vertex", "corner" or "face": what each normal belongs to; None: the mesh's domain.
out: must not overlap the points.

For a face without area the normal is (0, 0, 1); for a vertex without faces, the direction of its point; for a
vertex whose faces' normals cancel, 0. No result is NaN.)");
}

}  // namespace sinew::bindings
