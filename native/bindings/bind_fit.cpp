// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "interpolations.h"
#include "module.h"
#include "sinew/fit/average.h"
#include "sinew/fit/hand_eye.h"
#include "sinew/fit/rigid.h"

namespace sinew::bindings {
namespace {

// An argument whose last leading axis belongs to the item, such as the points of a set.
template <class T, class Value>
struct Rows {
    Input<T> input;
    py::ssize_t count;
};

// The rows of one item. Does not copy the input, because that counts Python's references and this runs without
// the GIL.
template <class Value, class T>
std::vector<Value> rows_of(const Input<T>& input, py::ssize_t count, py::ssize_t index, const Shape& common) {
    const auto size = input.item_size / std::max<py::ssize_t>(count, 1);
    const T* from = input.at(index, common);
    std::vector<Value> values;
    values.reserve(static_cast<std::size_t>(count));
    for (py::ssize_t i = 0; i < count; ++i) values.push_back(Item<Value>::read(from + i * size));
    return values;
}

// `like` is the number of rows of another argument; this one must have as many.
template <class T, class Value>
Rows<T, Value> checked_rows(const py::object& value, const char* argument, py::ssize_t like = -1) {
    Rows<T, Value> rows{checked_input<T, Value>(value, argument), 0};
    auto& lead = rows.input.lead;
    const std::string wanted =
        "an axis of " + (like < 0 ? std::string("them") : std::to_string(like)) + " before the last axes";
    if (lead.empty() || (like >= 0 && lead.back() != like)) fail(argument, wanted, describe(value));
    rows.count = lead.back();
    rows.input.item_size *= rows.count;
    lead.pop_back();
    return rows;
}

// None stands for no rows.
template <class T, class Value>
Rows<T, Value> optional_rows(const py::object& value, const char* argument, py::ssize_t like = -1) {
    if (!value.is_none()) return checked_rows<T, Value>(value, argument, like);
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

template <class F>
py::object with_fit(const py::object& method, F f) {
    std::string names;
    std::apply([&](auto... row) { ((names += (names.empty() ? "" : ", ") + std::string(row.name)), ...); },
               RigidFits{});
    const std::string wanted = "one of " + names;
    const std::string name = checked_name(method, "method", wanted);
    py::object result;
    const auto try_row = [&](auto row) {
        if (row.name == name) result = f(row);
    };
    std::apply([&](auto... row) { (try_row(row), ...); }, RigidFits{});
    if (!result) fail("method", wanted, "'" + name + "'");
    return result;
}

template <class Method, class T>
py::object fit_items(const std::array<py::object, 6>& values) {
    using Transform = typename Method::template Transform<T>;
    const auto source = checked_rows<T, Vec3<T>>(values[0], "source");
    const auto target = checked_rows<T, Vec3<T>>(values[1], "target", source.count);
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
    Output<std::tuple<Transform, T, bool, bool>> output(common);
    const py::ssize_t count = count_of(common);
    without_gil([&] {
        const auto rows = [&]<class Value>(const Rows<T, Value>& of, std::size_t index, py::ssize_t item) {
            return rows_of<Value>(inputs[index], of.count, item, common);
        };
        for (py::ssize_t i = 0; i < count; ++i) {
            const auto a = rows(source, 0, i);
            const auto b = rows(target, 1, i);
            const auto w = rows(weights, 2, i);
            const auto c = rows(source_directions, 3, i);
            const auto d = rows(target_directions, 4, i);
            const auto v = rows(direction_weights, 5, i);
            const auto fit = Method::fit(Pairs<T>{a, b, w, c, d, v});
            output.write(i, {fit.transform, fit.error, fit.is_defined, fit.is_mirrored});
        }
    });
    return output.take();
}

py::object rigid(const py::object& source, const py::object& target, const py::object& weights,
                 const py::object& source_directions, const py::object& target_directions,
                 const py::object& direction_weights, const py::object& method) {
    const auto values = promoted<6>(
        {"source", "target", "weights", "source_directions", "target_directions", "direction_weights"},
        {source, target, weights, source_directions, target_directions, direction_weights});
    return with_fit(method, [&]<class Method>(Method) {
        return with_element(values[0], "source", Item<Vec3<double>>::kShape,
                            [&]<class T>(T) { return fit_items<Method, T>(values); });
    });
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
    const auto a = checked_rows<T, Transform>(values[0], "a");
    const auto b = checked_rows<T, Transform>(values[1], "b", a.count);
    const auto weights = checked_weights<T>(values[2], "weights", a.count);
    std::array inputs{a.input, b.input, weights.input};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    Output<std::tuple<Transform, T, T, bool>> output(common);
    const py::ssize_t count = count_of(common);
    without_gil([&] {
        for (py::ssize_t i = 0; i < count; ++i) {
            const auto from = as_dual_quats<Transform, T>(rows_of<Transform>(inputs[0], a.count, i, common));
            const auto onto = as_dual_quats<Transform, T>(rows_of<Transform>(inputs[1], a.count, i, common));
            const auto w = rows_of<T>(inputs[2], weights.count, i, common);
            const auto found = hand_eye<T>(from, onto, w);
            output.write(i, {in_layout<Transform>(found.transform), found.error.angle,
                             found.error.translation, found.is_defined});
        }
    });
    return output.take();
}

py::object solve_hand_eye(const py::object& a, const py::object& b, const py::object& weights) {
    const auto values = promoted<3>({"a", "b", "weights"}, {a, b, weights});
    return with_representation(values[0], "a", "..", [&]<class Row>(Row) {
        return with_element(values[0], "a", "", [&]<class T>(T) {
            return hand_eye_items<typename Row::template Transform<T>, T>(values);
        });
    });
}

template <class Transform, class T>
py::object average_items(const std::array<py::object, 2>& values, bool is_robust) {
    const auto poses = checked_rows<T, Transform>(values[0], "poses");
    if (poses.count == 0) fail("poses", "at least one pose", "none");
    const auto weights = checked_weights<T>(values[1], "weights", poses.count);
    std::array inputs{poses.input, weights.input};
    const Shape common = broadcast(std::span<Input<T>>(inputs));
    Shape with_rows = common;
    with_rows.push_back(poses.count);
    Output<std::tuple<Transform, bool>> output(common);
    Output<T> parts(with_rows);
    const py::ssize_t count = count_of(common);
    without_gil([&] {
        for (py::ssize_t i = 0; i < count; ++i) {
            const auto of =
                as_dual_quats<Transform, T>(rows_of<Transform>(inputs[0], poses.count, i, common));
            const auto w = rows_of<T>(inputs[1], weights.count, i, common);
            const std::span<T> kept(parts.data + i * poses.count, of.size());
            std::fill(kept.begin(), kept.end(), T(1));
            const auto found = is_robust ? robust_average<T>(of, w, kept) : average<T>(of, w);
            output.write(i, {in_layout<Transform>(found.transform), found.is_defined});
        }
    });
    const py::tuple transforms = output.take();
    return py::make_tuple(transforms[0], transforms[1], parts.take());
}

py::object average_poses(const py::object& any_poses, const py::object& any_weights, bool is_robust) {
    const auto values = promoted<2>({"poses", "weights"}, {any_poses, any_weights});
    return with_representation(values[0], "poses", "..", [&]<class Row>(Row) {
        return with_element(values[0], "poses", "", [&]<class T>(T) {
            return average_items<typename Row::template Transform<T>, T>(values, is_robust);
        });
    });
}

}  // namespace

void bind_fit(py::module_& m) {
    auto fit = m.def_submodule("fit");
    py::list methods;
    std::apply([&](auto... row) { (methods.append(py::str(std::string(row.name))), ...); }, RigidFits{});
    fit.attr("METHODS") = py::tuple(methods);
    fit.def("rigid", &rigid, py::arg("source"), py::arg("target"), py::arg("weights"),
            py::arg("source_directions"), py::arg("target_directions"), py::arg("direction_weights"),
            py::arg("method"));
    fit.def("hand_eye", &solve_hand_eye, py::arg("a"), py::arg("b"), py::arg("weights"));
    fit.def("average", &average_poses, py::arg("poses"), py::arg("weights"), py::arg("is_robust"));
}

}  // namespace sinew::bindings
