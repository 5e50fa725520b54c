// SPDX-License-Identifier: GPL-3.0-or-later
#include "interpolations.h"
#include "module.h"
#include "sinew/ik/solver.h"

namespace sinew::bindings {
namespace {

struct Solver {
    IkSolver solver;
    std::size_t bone_count;
    std::size_t effector_count;
    bool has_pole;
};

template <class T>
py::array_t<T> checked_shape(const py::object& value, const char* argument, const Shape& shape,
                             const std::string& element) {
    const std::string wanted = element + " " + text_of(shape);
    auto array = checked<T>(value, argument, static_cast<py::ssize_t>(shape.size()), wanted);
    for (std::size_t axis = 0; axis < shape.size(); ++axis) {
        if (array.shape(static_cast<py::ssize_t>(axis)) != shape[axis])
            fail(argument, wanted, describe(value));
    }
    return array;
}

std::vector<BoneLimits> limits_of(const py::object& locked, const py::object& limits,
                                  const py::object& stiffness, std::size_t bone_count) {
    const auto bones = static_cast<py::ssize_t>(bone_count);
    std::vector<BoneLimits> result(bone_count);
    const auto each = [&](auto f) {
        for (std::size_t i = 0; i < 3 * bone_count; ++i) f(result[i / 3][i % 3], i);
    };
    if (!locked.is_none()) {
        const auto of = checked_shape<std::int32_t>(locked, "locked", {bones, 3}, "bool");
        each([&](AxisLimit& limit, std::size_t i) { limit.is_locked = of.data()[i] != 0; });
    }
    if (!stiffness.is_none()) {
        const auto of = checked_shape<double>(stiffness, "stiffness", {bones, 3}, "float64");
        each([&](AxisLimit& limit, std::size_t i) { limit.stiffness = of.data()[i]; });
    }
    if (!limits.is_none()) {
        const auto of = checked_shape<double>(limits, "limits", {bones, 3, 2}, "float64");
        each([&](AxisLimit& limit, std::size_t i) {
            const double min = of.data()[2 * i];
            const double max = of.data()[2 * i + 1];
            limit.is_limited = !(std::isinf(min) && min < 0.0 && std::isinf(max) && max > 0.0);
            limit.min = min;
            limit.max = max;
        });
    }
    return result;
}

std::unique_ptr<Solver> make(const py::object& any_parents, const py::object& any_bones,
                             const py::object& any_weights, const py::object& any_poles,
                             const py::object& locked, const py::object& limits,
                             const py::object& stiffness) {
    const auto parents = checked<std::int32_t>(any_parents, "parents", 1, "int32 [bones]");
    const auto bones = checked<std::int32_t>(any_bones, "effectors", 1, "bones, int32 [effectors]");
    const py::ssize_t count = bones.shape(0);
    const auto weights = checked_shape<double>(any_weights, "effectors", {count, 2}, "weights, float64");
    const auto poles = checked_shape<double>(any_poles, "effectors", {count, 2}, "poles, float64");
    std::vector<IkEffector> effectors;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        effectors.push_back({.bone = bones.data()[i],
                             .position_weight = weights.data()[2 * i],
                             .rotation_weight = weights.data()[2 * i + 1],
                             .has_pole = poles.data()[2 * i] != 0.0,
                             .pole_angle = poles.data()[2 * i + 1]});
    }
    const Skeleton skeleton(as_span(parents));
    const std::size_t bone_count = skeleton.bone_count();
    const bool has_pole = effectors.size() == 1 && effectors[0].has_pole;
    return std::make_unique<Solver>(
        Solver{IkSolver(skeleton, limits_of(locked, limits, stiffness, bone_count), effectors), bone_count,
               effectors.size(), has_pole});
}

/// `array` as float64 [.., count, numbers of a Value]: its last two axes are an item, the others broadcast.
template <class Value>
Input<double> of_each(const py::array_t<double>& array, const char* argument, std::size_t count,
                      const std::string& of_what) {
    const auto wanted = static_cast<py::ssize_t>(count);
    const auto input = checked_input<double, Value>(array, argument);
    Shape lead = input.lead;
    if (lead.empty() || lead.back() != wanted) {
        fail(argument, std::to_string(wanted) + " " + of_what + " before the last axes", describe(array));
    }
    lead.pop_back();
    return {argument, input.array, input.data, lead, input.item_size * wanted};
}

py::array_t<double> as_double(const py::object& value, const char* argument, const std::string& wanted) {
    const auto given = promoted<1>({argument}, {value});
    is_double(given[0], argument, wanted);
    return in_order<double>(given[0]);
}

template <class Value>
Input<double> checked_each(const py::object& value, const char* argument, std::size_t count,
                           const std::string& of_what) {
    const std::string wanted = std::string("float32 or float64 ") + Item<Value>::kShape;
    return of_each<Value>(as_double(value, argument, wanted), argument, count, of_what);
}

/// Transforms in any layout as unit dual quaternions.
py::array_t<double> as_dual_quats(const py::object& value, const char* argument, const std::string& axes) {
    const auto given = promoted<1>({argument}, {value});
    py::array_t<double> result;
    with_representation(given[0], argument, axes, [&]<class Row>(Row) {
        using Transform = typename Row::template Transform<double>;
        const auto array = in_order<double>(given[0]);
        const auto input = checked_input<double, Transform>(array, argument);
        Output<DualQuat<double>> output(input.lead);
        const py::ssize_t count = count_of(input.lead);
        for (py::ssize_t i = 0; i < count; ++i) {
            output.write(i,
                         to_dual_quat(normalized(Item<Transform>::read(input.data + i * input.item_size))));
        }
        result = output.array;
        return py::none();
    });
    return result;
}

IkOptions checked_options(const py::object& method, const py::object& tolerance,
                          const py::object& iterations) {
    IkOptions options;
    std::string names;
    for (const std::string_view name : kIkMethods) {
        names += (names.empty() ? "" : ", ") + std::string(name);
    }
    const std::string name = checked_name(method, "method", "one of " + names);
    std::size_t found = 0;
    while (found < kIkMethods.size() && kIkMethods[found] != name) ++found;
    if (found == kIkMethods.size()) fail("method", "one of " + names, "'" + name + "'");
    options.method = static_cast<IkMethod>(found);
    const std::string positive = "a finite number above 0";
    options.tolerance = checked_number(tolerance, "tolerance", positive);
    if (!(options.tolerance > 0.0) || !std::isfinite(options.tolerance)) {
        fail("tolerance", positive, std::to_string(options.tolerance));
    }
    options.iterations = static_cast<int>(
        checked_integer(iterations, "iterations", "a whole number, 0 to 1000000", 1'000'000));
    return options;
}

py::object solve(Solver& self, const py::object& rest, const py::object& tips, const py::object& goals,
                 const py::object& poles, const py::object& rotations, const py::object& root,
                 const py::object& method, const py::object& tolerance, const py::object& iterations) {
    const IkOptions options = checked_options(method, tolerance, iterations);
    const std::size_t bones = self.bone_count;
    const std::size_t effectors = self.effector_count;
    if (self.has_pole && poles.is_none()) fail("poles", "a point for the effector with a pole", "None");
    const Shape one_root{8};
    py::array_t<double> no_rotations(Shape{static_cast<py::ssize_t>(bones), 4});
    py::array_t<double> no_root(one_root);
    for (std::size_t i = 0; i < 4 * bones; ++i) no_rotations.mutable_data()[i] = i % 4 == 0 ? 1.0 : 0.0;
    for (std::size_t i = 0; i < 8; ++i) no_root.mutable_data()[i] = i == 0 ? 1.0 : 0.0;
    const auto root_array = root.is_none() ? no_root : as_dual_quats(root, "root", "..");
    std::vector<Input<double>> inputs{
        of_each<DualQuat<double>>(as_dual_quats(rest, "rest", ".., bones"), "rest", bones, "bones"),
        checked_each<Vec3<double>>(tips, "tips", effectors, "effectors"),
        of_each<DualQuat<double>>(as_dual_quats(goals, "goals", ".., effectors"), "goals", effectors,
                                  "effectors"),
        rotations.is_none() ? of_each<Quat<double>>(no_rotations, "rotations", bones, "bones")
                            : checked_each<Quat<double>>(rotations, "rotations", bones, "bones"),
        checked_input<double, DualQuat<double>>(root_array, "root")};
    if (!poles.is_none())
        inputs.push_back(checked_each<Vec3<double>>(poles, "poles", effectors, "effectors"));
    const Shape common = broadcast(std::span<Input<double>>(inputs));
    Shape with_bones = common;
    with_bones.push_back(static_cast<py::ssize_t>(bones));
    Output<Quat<double>> solved(with_bones);
    Output<std::tuple<double, double, bool>> facts(common);
    py::array_t<std::int32_t> taken(common);
    std::int32_t* const iterations_taken = taken.mutable_data();
    const py::ssize_t count = count_of(common);
    without_gil([&] {
        std::vector<DualQuat<double>> parent_from_rest(bones);
        std::vector<DualQuat<double>> wanted(effectors);
        std::vector<Vec3<double>> offsets(effectors);
        std::vector<Vec3<double>> points(effectors);
        std::vector<Quat<double>> own(bones);
        const auto read = [&](std::size_t input, py::ssize_t item, auto& values) {
            using Value = typename std::remove_reference_t<decltype(values)>::value_type;
            const double* from = inputs[input].at(item, common);
            for (Value& value : values) {
                value = Item<Value>::read(from);
                from += Item<Value>::kSize;
            }
        };
        for (py::ssize_t i = 0; i < count; ++i) {
            read(0, i, parent_from_rest);
            read(1, i, offsets);
            read(2, i, wanted);
            read(3, i, own);
            for (Quat<double>& q : own) {
                const double length = glm::length(q);
                q = length > 0.0 && std::isfinite(length) ? q / length : Quat<double>(1.0, 0.0, 0.0, 0.0);
            }
            if (inputs.size() > 5) read(5, i, points);
            const auto from_root = Item<DualQuat<double>>::read(inputs[4].at(i, common));
            const IkResult result =
                self.solver.solve({from_root, parent_from_rest, offsets, wanted, points}, own, options)
                    .value();
            for (std::size_t bone = 0; bone < bones; ++bone) {
                solved.write(i * static_cast<py::ssize_t>(bones) + static_cast<py::ssize_t>(bone), own[bone]);
            }
            facts.write(i, {result.distance, result.angle, result.is_reached});
            iterations_taken[i] = result.iterations;
        }
    });
    const py::tuple of = facts.take();
    const py::object steps = common.empty() ? py::object(taken[py::tuple()]) : py::object(taken);
    return py::make_tuple(solved.take(), of[0], of[1], steps, of[2]);
}

py::object angles(const py::object& rotations) {
    return map<Quat>({"rotations"}, {rotations}, []<class T>(const Quat<T>& q) {
        return Vec3<T>(swing_twist_angles(glm::normalize(Quat<double>(q))));
    });
}

}  // namespace

void bind_ik(py::module_& m) {
    auto ik = m.def_submodule("ik");
    py::list methods;
    for (const std::string_view name : kIkMethods) methods.append(py::str(std::string(name)));
    ik.attr("METHODS") = py::tuple(methods);
    ik.def("swing_twist_angles", &angles, py::arg("rotations"));
    py::class_<Solver>(ik, "Solver")
        .def(py::init(&make), py::arg("parents"), py::arg("bones"), py::arg("weights"), py::arg("poles"),
             py::arg("locked"), py::arg("limits"), py::arg("stiffness"))
        .def("solve", &solve, py::arg("rest"), py::arg("tips"), py::arg("goals"), py::arg("poles"),
             py::arg("rotations"), py::arg("root"), py::arg("method"), py::arg("tolerance"),
             py::arg("iterations"));
}

}  // namespace sinew::bindings
