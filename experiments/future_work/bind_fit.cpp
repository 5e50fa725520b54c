// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "future_work/fit/average.h"
#include "future_work/fit/hand_eye.h"
#include "future_work/fit/rigid.h"
#include "future_work/module.h"
#include "interpolations.h"

namespace sinew::bindings {
namespace {

// An argument whose last leading axis belongs to the item, such as the points of a set.
template <class T, class Value>
struct Rows {
    Input<T> input;
    py::ssize_t count;
};

template <class Value, class T>
std::vector<Value> rows_of(const Input<T>& input, py::ssize_t count, py::ssize_t index, const Shape& common) {
    std::vector<Value> values(static_cast<std::size_t>(count));
    read_rows(input, index, common, values);
    return values;
}

// `like` is the number of rows of another argument; this one must have as many.
template <class T, class Value>
Rows<T, Value> rows_in(const py::object& value, const char* argument, py::ssize_t like = -1) {
    Rows<T, Value> rows{checked_input<T, Value>(value, argument), 0};
    const std::string number = like < 0 ? "them" : std::to_string(like);
    rows.count = take_last_axis(rows.input, value, "an axis of " + number + " before the last axes", like);
    return rows;
}

// None stands for no rows.
template <class T, class Value>
Rows<T, Value> optional_rows(const py::object& value, const char* argument, py::ssize_t like = -1) {
    if (!value.is_none()) return rows_in<T, Value>(value, argument, like);
    const py::array_t<T> nothing(Shape{0});
    return {Input<T>{argument, nothing, nothing.data(), {}, 0}, 0};
}

template <class T>
Rows<T, T> checked_weights(const py::object& value, const char* argument, py::ssize_t like) {
    auto rows = optional_rows<T, T>(value, argument, like);
    const py::ssize_t count = rows.input.array.size();
    for (py::ssize_t i = 0; i < count; ++i) {
        if (rows.input.data[i] < T(0))
            fail(argument, "weights not below 0", "one below 0 at index " + std::to_string(i));
    }
    return rows;
}

template <class T>
py::object fit_items(const std::array<py::object, 6>& values) {
    const auto source = rows_in<T, Vec3<T>>(values[0], "source");
    const auto target = rows_in<T, Vec3<T>>(values[1], "target", source.count);
    const auto weights = checked_weights<T>(values[2], "weights", source.count);
    const auto source_directions = optional_rows<T, Vec3<T>>(values[3], "source_directions");
    const auto target_directions =
        optional_rows<T, Vec3<T>>(values[4], "target_directions", source_directions.count);
    if (target_directions.count != source_directions.count) {
        fail("target_directions",
             std::to_string(source_directions.count) + ", one for each of source_directions", "none");
    }
    const auto direction_weights =
        checked_weights<T>(values[5], "direction_weights", source_directions.count);
    std::array inputs{
        source.input,           target.input, weights.input, source_directions.input, target_directions.input,
        direction_weights.input};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    using Fit = Named<"RigidFit", QuatVec<T>, T, bool, bool>;
    return each_of<Fit>(common, [&](py::ssize_t i) -> Fit {
        const auto rows = [&]<class Value>(const Rows<T, Value>& of, std::size_t index) {
            return rows_of<Value>(inputs[index], of.count, i, common);
        };
        const auto a = rows(source, 0);
        const auto b = rows(target, 1);
        const auto w = rows(weights, 2);
        const auto c = rows(source_directions, 3);
        const auto d = rows(target_directions, 4);
        const auto v = rows(direction_weights, 5);
        const auto fit = fit_rigid(Pairs<T>{a, b, w, c, d, v});
        return {fit.transform, fit.error, fit.is_defined, fit.is_mirrored};
    });
}

Typed<"future_work.types.RigidFit[typing.Any]"> rigid(const ArrayLike& source, const ArrayLike& target,
                                                      const OptionalArrayLike& weights,
                                                      const OptionalArrayLike& source_directions,
                                                      const OptionalArrayLike& target_directions,
                                                      const OptionalArrayLike& direction_weights) {
    const auto values = promoted<6>(
        {"source", "target", "weights", "source_directions", "target_directions", "direction_weights"},
        {source, target, weights, source_directions, target_directions, direction_weights});
    return with_element(values[0], "source", Item<Vec3<double>>::kShape,
                        [&]<class T>(T) { return fit_items<T>(values); });
}

template <class Transform, class T>
std::vector<DualQuat<T>> as_dual_quats(const std::vector<Transform>& transforms) {
    std::vector<DualQuat<T>> result;
    result.reserve(transforms.size());
    for (const Transform& transform : transforms) result.push_back(to_dual_quat(normalized(transform)));
    return result;
}

template <class Transform, class T>
Transform in_layout(const DualQuat<T>& a) {
    if constexpr (std::is_same_v<Transform, Affine<T>>) {
        return to_affine(a);
    } else if constexpr (std::is_same_v<Transform, QuatVec<T>>) {
        return to_quat_vec(a);
    } else {
        return a;
    }
}

template <class Transform, class T>
py::object hand_eye_items(const std::array<py::object, 3>& values) {
    const auto a = rows_in<T, Transform>(values[0], "a");
    const auto b = rows_in<T, Transform>(values[1], "b", a.count);
    const auto weights = checked_weights<T>(values[2], "weights", a.count);
    std::array inputs{a.input, b.input, weights.input};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    using Found = Named<"HandEye", Transform, T, T, bool>;
    return each_of<Found>(common, [&](py::ssize_t i) -> Found {
        const auto from = as_dual_quats<Transform, T>(rows_of<Transform>(inputs[0], a.count, i, common));
        const auto onto = as_dual_quats<Transform, T>(rows_of<Transform>(inputs[1], a.count, i, common));
        const auto w = rows_of<T>(inputs[2], weights.count, i, common);
        const auto found = hand_eye<T>(from, onto, w);
        return {in_layout<Transform>(found.transform), found.error.angle, found.error.translation,
                found.is_defined};
    });
}

Typed<"future_work.types.HandEye[typing.Any]"> solve_hand_eye(const ArrayLike& a, const ArrayLike& b,
                                                              const OptionalArrayLike& weights) {
    const auto values = promoted<3>({"a", "b", "weights"}, {a, b, weights});
    return with_layout(values[0], "a", "..",
                       [&]<class Transform, class T>() { return hand_eye_items<Transform, T>(values); });
}

template <class Transform, class T>
py::object average_items(const std::array<py::object, 2>& values, bool is_robust) {
    const auto poses = rows_in<T, Transform>(values[0], "poses");
    if (poses.count == 0) fail("poses", "at least one pose", "none");
    const auto weights = checked_weights<T>(values[1], "weights", poses.count);
    std::array inputs{poses.input, weights.input};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    Shape with_rows = common;
    with_rows.push_back(poses.count);
    Output<T> parts(with_rows);
    using Found = std::tuple<Transform, bool>;
    const py::tuple transforms = each_of<Found>(common, [&](py::ssize_t i) -> Found {
        const auto of = as_dual_quats<Transform, T>(rows_of<Transform>(inputs[0], poses.count, i, common));
        const auto w = rows_of<T>(inputs[1], weights.count, i, common);
        const std::span<T> kept(parts.data + i * poses.count, of.size());
        std::fill(kept.begin(), kept.end(), T(1));
        const auto found = is_robust ? robust_average<T>(of, w, kept) : average<T>(of, w);
        return {in_layout<Transform>(found.transform), found.is_defined};
    });
    return named_tuple("Averaged", py::make_tuple(transforms[0], transforms[1], parts.take()));
}

Typed<"future_work.types.Averaged[typing.Any]"> average_poses(const ArrayLike& any_poses,
                                                              const OptionalArrayLike& any_weights,
                                                              bool is_robust) {
    const auto values = promoted<2>({"poses", "weights"}, {any_poses, any_weights});
    return with_layout(values[0], "poses", "..", [&]<class Transform, class T>() {
        return average_items<Transform, T>(values, is_robust);
    });
}

}  // namespace

void bind_fit(py::module_& m) {
    auto fit = m.def_submodule("fit");
    fit.def("rigid", &rigid, "source"_a, "target"_a, "weights"_a = py::none(), py::kw_only(),
            "source_directions"_a = py::none(), "target_directions"_a = py::none(),
            "direction_weights"_a = py::none(),
            R"(The rigid transform that maps `source` to `target` with the smallest weighted sum of squared
distances.

source, target: [.., n, 3], points. n may be 0 if there are directions; the translation is then 0.
weights: [.., n], not negative; None: 1 each.
source_directions, target_directions: [.., m, 3], or None. Any length, which is ignored; a pair in which
    either has length 0 does not count.
direction_weights: [.., m], not negative; None: 1 each. A direction counts as a point at distance 1 from the
    middle, so its weight is in squares of lengths.

The result is in the layout of sinew.quat_vec. Its rotation is an eigenvector of a 4x4 matrix (Horn 1987).

Not defined: points on one line or all in one position, a mirror image with a symmetry, no positive weight
(the identity). For points in a plane the fit is defined. is_mirrored: a mirror image would fit better; the
result is still the best rotation.)");
    fit.def(
        "hand_eye", &solve_hand_eye, "a"_a, "b"_a, "weights"_a = py::none(),
        R"(Solves a x = x b for x: the pose of one of two bodies that are fixed to each other, seen from the
other.

a, b: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], in one layout, which the result has as well: n
    motions of the one body and the same motions of the other, in one unit of length, such as of a robot's
    hand and of the camera on it, or of a bone and of a marker. A matrix's linear part is replaced by the
    nearest rotation.
weights: [.., n], not negative; None: 1 each.

Uses dual quaternions, which give rotation and translation at once (Daniilidis 1999). Then solves for the
translation again, by least squares for that rotation (Park, Martin 1994), which is less sensitive to noise.
Not defined: fewer than two motions, rotations only about parallel axes, only rotations by 180 degrees, no
positive weight.)");
    fit.def("average", &average_poses, "poses"_a, "weights"_a = py::none(), py::kw_only(), "robust"_a = false,
            R"(The mean of n poses, in their layout. Signs of quaternions and the order do not matter.

poses: [.., n, 4, 4], [.., n, 3, 4], [.., n, 7] or [.., n, 8], n >= 1. A matrix's linear part is replaced by
    the nearest rotation.
weights: [.., n], not negative; None: 1 each.
robust: weight each pose by Tukey's biweight of its angle and of its distance from the mean, which decreases
    with both and is 0 from 3.5 times their medians on (Beaton and Tukey 1974): almost half of the weight may
    be outliers. `kept` says how much each pose counts. Distances are those between images of the origin, so
    the origin should be within what moves.

Without `robust`, the pose relative to which the weighted screws to all poses sum to 0, as for "dib" of
sinew.interpolate (Kavan et al. 2008, algorithm 3). The iteration starts at the mean of the rotation matrices
(Markley et al. 2007). The result does not depend on the origin or on the unit of length. Not defined: several
equally good means, such as for rotations by 0, 120 and 240 degrees about one axis; a pose 180 degrees from
the result; no positive weight (the identity). With `robust`, also not defined if the poses that count do not
have more than half of the weight, or are not all within 90 degrees of the result.)");
}

}  // namespace sinew::bindings
