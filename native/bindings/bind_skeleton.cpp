// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "sinew/skeleton/forward_kinematics.h"

namespace sinew::bindings {
namespace {

Skeleton make_skeleton(const ArrayLike& parents) {
    const auto array = checked<std::int32_t>(parents, "parents", 1, "int32 [bones]");
    return Skeleton({array.data(), static_cast<std::size_t>(array.size())});
}

// Transforms [bones, ..] in one representation, one for each bone.
template <class Transform, class T>
std::vector<Transform> checked_bones(const Skeleton& skeleton, const py::object& value,
                                     const char* argument) {
    const auto input = checked_input<T, Transform>(value, argument);
    if (input.lead.size() != 1) fail(argument, "one axis of bones", describe(value));
    if (input.lead[0] != static_cast<py::ssize_t>(skeleton.bone_count())) {
        fail(argument, std::to_string(skeleton.bone_count()) + " bones", std::to_string(input.lead[0]));
    }
    return items_of<Transform>(input);
}

template <class Transform>
py::object as_array(const std::vector<Transform>& bones) {
    Output<Transform> output({static_cast<py::ssize_t>(bones.size())});
    for (std::size_t bone = 0; bone < bones.size(); ++bone) {
        output.write(static_cast<py::ssize_t>(bone), bones[bone]);
    }
    return output.take();
}

// One transform; the identity if `value` is None.
template <class Transform, class T>
Transform checked_root(const py::object& value) {
    if (value.is_none()) return {};
    const auto input = checked_input<T, Transform>(value, "root");
    if (!input.lead.empty()) fail("root", "one transform", describe(value));
    return Item<Transform>::read(input.data);
}

Array relative_to_root(const Skeleton& skeleton, const ArrayLike& any_transforms,
                       const OptionalArrayLike& any_root) {
    const auto [transforms, root] = promoted<2>({"transforms", "root"}, {any_transforms, any_root});
    return with_layout(transforms, "transforms", "bones", [&]<class Transform, class T>() {
        auto bones = checked_bones<Transform, T>(skeleton, transforms, "transforms");
        const auto before = checked_root<Transform, T>(root);
        // Their numbers were checked.
        static_cast<void>(root_relative<Transform>(skeleton, before, bones, bones));
        return as_array(bones);
    });
}

Array branch_updated(const Skeleton& skeleton, const ArrayLike& any_relative, const ArrayLike& any_transforms,
                     const Index& bone, const OptionalArrayLike& any_root) {
    const auto [relative, transforms, root] =
        promoted<3>({"root_relative", "transforms", "root"}, {any_relative, any_transforms, any_root});
    const std::string wanted = "the index of one of " + std::to_string(skeleton.bone_count()) + " bones";
    const double index = checked_number(bone, "bone", wanted);
    if (!(index >= 0.0) || index >= static_cast<double>(skeleton.bone_count()) ||
        index != std::floor(index)) {
        fail("bone", wanted, std::string(py::str(bone)));
    }
    return with_layout(transforms, "transforms", "bones", [&]<class Transform, class T>() {
        const auto bones = checked_bones<Transform, T>(skeleton, transforms, "transforms");
        auto result = checked_bones<Transform, T>(skeleton, relative, "root_relative");
        const auto before = checked_root<Transform, T>(root);
        static_cast<void>(
            update_branch<Transform>(skeleton, before, bones, static_cast<std::size_t>(index), result));
        return as_array(result);
    });
}

}  // namespace

void bind_skeleton(py::module_& m) {
    py::class_<Skeleton>(m, "Skeleton",
                         R"(A hierarchy of bones in which parents precede their children.

Its methods take each bone relative to its parent, in any layout of sinew.affine, sinew.quat_vec and
sinew.dual_quat. Can be pickled.)")
        .def(
            py::init(&make_skeleton), "parents"_a,
            R"(parents: int32 [bones], the index of each bone's parent, -1 for a root. ValueError if a parent does not
    precede its child.)")
        .def_property_readonly("bone_count", &Skeleton::bone_count, "Number of bones.")
        .def("__repr__",
             [](const Skeleton& skeleton) {
                 return "<sinew.Skeleton: " + std::to_string(skeleton.bone_count()) + " bones>";
             })
        .def(py::pickle([](const Skeleton& skeleton) { return py::make_tuple(array_of(skeleton.parents())); },
                        [](const py::object& state) { return make_skeleton(part_of(state, 1, 0)); }))
        .def("root_relative", &relative_to_root, "transforms"_a, "root"_a = py::none(),
             R"(Each bone relative to the root, in the layout of `transforms` (Smith 2013, algorithm 1).

transforms: [bones, 4, 4] or [bones, 3, 4], for which the result is [bones, 4, 4]; [bones, 7]; [bones, 8].
root: None, or a transform that is applied after that of every bone without a parent.)")
        .def(
            "update_branch", &branch_updated, "root_relative"_a, "transforms"_a, "bone"_a,
            "root"_a = py::none(),
            R"(The result of root_relative() after a change of one bone: computes only that bone and its descendants.

root_relative: the result before the change, in the layout of `transforms`.
transforms, root: as for root_relative().
bone: the index of the changed bone.)");
}

}  // namespace sinew::bindings
