// SPDX-License-Identifier: GPL-3.0-or-later
#include "arrays.h"
#include "module.h"
#include "sinew/skeleton/forward_kinematics.h"

namespace sinew::bindings {

void bind_skeleton(py::module_& m) {
    py::class_<Skeleton>(m, "Skeleton", "A hierarchy of bones; parents come before their children.")
        .def(py::init([](const py::object& parents) {
                 const auto array = checked<std::int32_t>(parents, "parents", 1, "int32 [bones]");
                 return Skeleton({array.data(), static_cast<std::size_t>(array.size())});
             }),
             py::arg("parents"),
             "parents: int32 [bones], the index of each bone's parent, -1 for a root.\n\n"
             "Raises ValueError where a parent does not come before its child.")
        .def_property_readonly("bone_count", &Skeleton::bone_count)
        .def(
            "root_relative",
            [](const Skeleton& skeleton, const py::object& transforms) {
                auto bones = checked_affines(transforms, "transforms");
                if (bones.size() != skeleton.bone_count()) {
                    fail("transforms", std::to_string(skeleton.bone_count()) + " bones",
                         std::to_string(bones.size()));
                }
                root_relative<Affine<float>>(skeleton, {}, bones, bones);
                py::array_t<float> result(
                    {static_cast<py::ssize_t>(bones.size()), py::ssize_t{4}, py::ssize_t{4}});
                auto out = result.mutable_unchecked<3>();
                for (py::ssize_t bone = 0; bone < out.shape(0); ++bone) {
                    const Affine<float>& a = bones[static_cast<std::size_t>(bone)];
                    for (int row = 0; row < 3; ++row) {
                        for (int column = 0; column < 3; ++column)
                            out(bone, row, column) = a.linear[column][row];
                        out(bone, row, 3) = a.translation[row];
                        out(bone, 3, row) = 0.0f;
                    }
                    out(bone, 3, 3) = 1.0f;
                }
                return result;
            },
            py::arg("transforms"),
            "Each bone relative to the root, float32 [bones, 4, 4] (Smith 2013, algorithm 1).\n\n"
            "transforms: float32 [bones, 4, 4] or [bones, 3, 4], each bone relative to its parent.\n\n"
            "Raises ValueError for another shape, element type or number of bones, NaN or infinity.");
}

}  // namespace sinew::bindings
