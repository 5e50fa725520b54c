// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "sinew/skeleton/forward_kinematics.h"
#include "sinew/skeleton/keyframes.h"

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

using Method = Typed<"sinew.interpolate.Method">;
using Frames = Typed<"tuple[numpy.typing.NDArray[typing.Any], bool | numpy.typing.NDArray[numpy.bool_]]">;

// (transforms, is_defined) from run(moment, bones) for each number in `at`: for one number [bones, ..] and a
// bool, for numbers [..] the shapes [.., bones, ..] and [..].
template <class Transform, class T, class Run>
py::object at_all(const Skeleton& skeleton, const Input<T>& at, Run run) {
    Shape shape = at.lead;
    shape.push_back(static_cast<py::ssize_t>(skeleton.bone_count()));
    Output<Transform> transforms(shape);
    Output<bool> is_defined(at.lead);
    const py::ssize_t count = count_of(at.lead);
    const auto bone_count = static_cast<py::ssize_t>(skeleton.bone_count());
    without_gil([&] {
        std::vector<Transform> bones(skeleton.bone_count());
        for (py::ssize_t i = 0; i < count; ++i) {
            is_defined.write(i, run(at.data[i], std::span<Transform>(bones)));
            for (py::ssize_t bone = 0; bone < bone_count; ++bone) {
                transforms.write(i * bone_count + bone, bones[static_cast<std::size_t>(bone)]);
            }
        }
    });
    if (at.lead.empty()) return py::make_tuple(transforms.take(), static_cast<bool>(is_defined.data[0]));
    return py::make_tuple(transforms.take(), is_defined.take());
}

Frames interpolate(const Skeleton& skeleton, const ArrayLike& any_a, const ArrayLike& any_b,
                   const ArrayLike& any_t, const Method& method) {
    const auto [a, b, t] = promoted<3>({"a", "b", "t"}, {any_a, any_b, any_t});
    return with_method(method, a, "a", [&]<class Method, class T>() {
        using Transform = typename Method::template Transform<T>;
        const auto from = checked_bones<Transform, T>(skeleton, a, "a");
        const auto onto = checked_bones<Transform, T>(skeleton, b, "b");
        return at_all<Transform, T>(skeleton, checked_input<T, T>(t, "t"), [&](T part, auto bones) {
            return interpolate_keyframes<Method, T>(skeleton, from, onto, part, bones);
        });
    });
}

// Calls run(keyframes, times, time, bones) with checked arrays.
template <class Transform, class T, class Run>
py::object spline_bones(const Skeleton& skeleton, const py::object& keyframes, const py::object& times,
                        const py::object& time, Run run) {
    const auto input = checked_input<T, Transform>(keyframes, "keyframes");
    const auto bone_count = static_cast<py::ssize_t>(skeleton.bone_count());
    if (input.lead.size() != 2 || input.lead[0] == 0 || input.lead[1] != bone_count) {
        fail("keyframes", "one key or more of " + std::to_string(bone_count) + " bones", describe(keyframes));
    }
    const std::vector<Transform> keys = items_of<Transform>(input);
    const std::vector<T> key_times = checked_times<T>(times, input.lead[0]);
    return at_all<Transform, T>(skeleton, checked_input<T, T>(time, "time"), [&](T now, auto bones) {
        return run(std::span<const Transform>(keys), std::span<const T>(key_times), now, bones);
    });
}

Frames spline(const Skeleton& skeleton, const ArrayLike& any_keyframes, const ArrayLike& any_times,
              const ArrayLike& any_time, const Method& method) {
    const auto [keyframes, times, time] =
        promoted<3>({"keyframes", "times", "time"}, {any_keyframes, any_times, any_time});
    return with_method(method, keyframes, "keyframes", [&]<class Method, class T>() {
        return spline_bones<typename Method::template Transform<T>, T>(
            skeleton, keyframes, times, time, [&](auto keys, auto at, T now, auto bones) {
                return spline_keyframes<Method, T>(skeleton, keys, at, now, bones);
            });
    });
}

Frames spline_vector_form(const Skeleton& skeleton, const ArrayLike& any_keyframes,
                          const ArrayLike& any_times, const ArrayLike& any_time) {
    const auto [keyframes, times, time] =
        promoted<3>({"keyframes", "times", "time"}, {any_keyframes, any_times, any_time});
    return with_layout(keyframes, "keyframes", "keys, bones", [&]<class Transform, class T>() {
        return spline_bones<Transform, T>(
            skeleton, keyframes, times, time, [&](auto keys, auto at, T now, auto bones) {
                return spline_keyframes_vector<Transform, T>(skeleton, keys, at, now, bones);
            });
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
bone: the index of the changed bone.)")
        .def("interpolate", &interpolate, "a"_a, "b"_a, "t"_a, "method"_a = "dlb",
             R"((transforms, is_defined): the skeleton between two keyframes (Smith 2013, algorithm 2).

a, b: [bones, ..] in the layout of the method, at t = 0 and t = 1.
t: a number, or [..], for which the results are [.., bones, ..] and [..]; extrapolates outside 0 to 1.
method: one of sinew.interpolate.METHODS.

is_defined is False if the result is not defined for some bone, which then has the result that
sinew.interpolate specifies.)")
        .def(
            "spline", &spline, "keyframes"_a, "times"_a, "time"_a, "method"_a = "dlb",
            R"((transforms, is_defined): the skeleton on a Catmull-Rom spline through keyframes, in blend form (Smith
2013, algorithm 3 and section 3.2.2).

keyframes: [keys, bones, ..] in the layout of the method, at least one key.
times: [keys], non-decreasing; keys of equal time are a cut.
time: a number, or [..], for which the results are [.., bones, ..] and [..]; constant before the first key and
    after the last.
method: one of sinew.interpolate.METHODS.)")
        .def("spline_vector", &spline_vector_form, "keyframes"_a, "times"_a, "time"_a,
             R"(As spline(), in vector form (Smith 2013, algorithm 3): not rigid between keys.

keyframes: [keys, bones, 4, 4], [keys, bones, 3, 4], [keys, bones, 7] or [keys, bones, 8].)");
}

}  // namespace sinew::bindings
