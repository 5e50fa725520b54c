// SPDX-License-Identifier: GPL-3.0-or-later
#include "future_work/ik/solver.h"
#include "future_work/module.h"
#include "interpolations.h"

namespace sinew::bindings {
namespace {

using Solution = Typed<"future_work.types.Solution">;

struct Solver {
    IkSolver solver;
    bool has_pole;
};

template <class T>
py::array_t<T> checked_shape(const py::object& value, const char* argument, const Shape& shape,
                             const std::string& element) {
    const std::string wanted = element + " " + shape_text(shape);
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

using Effectors = Typed<"collections.abc.Sequence[future_work.ik.Effector]">;

/// A tuple that is, or could be, a future_work.ik.Effector.
IkEffector checked_effector(const py::handle& value) {
    if (!py::isinstance<py::tuple>(value) || py::len(value) != 5) {
        fail("effectors", "an Effector", describe(value));
    }
    const auto parts = py::reinterpret_borrow<py::tuple>(value);
    const int has_pole = PyObject_IsTrue(parts[3].ptr());
    if (has_pole < 0) {
        PyErr_Clear();
        fail("effectors", "has_pole true or false", describe(parts[3]));
    }
    const auto number = [&](std::size_t part) {
        return checked_number(parts[part], "effectors", "weights and an angle that are numbers");
    };
    constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
    const std::size_t bone = checked_integer(parts[0], "effectors", "the index of a bone", kMost);
    return {.bone = static_cast<std::int32_t>(bone),
            .position_weight = number(1),
            .rotation_weight = number(2),
            .has_pole = has_pole != 0,
            .pole_angle = number(4)};
}

std::unique_ptr<Solver> make(const ArrayLike& any_parents, const Effectors& any_effectors,
                             const OptionalArrayLike& locked, const OptionalArrayLike& limits,
                             const OptionalArrayLike& stiffness) {
    const auto parents = checked<std::int32_t>(any_parents, "parents", 1, "int32 [bones]");
    // An array of no dimensions says that it is a sequence, too.
    const auto items = py::reinterpret_steal<py::object>(PySequence_Fast(any_effectors.ptr(), ""));
    if (!items) {
        PyErr_Clear();
        fail("effectors", "a sequence of Effectors", describe(any_effectors));
    }
    std::vector<IkEffector> effectors;
    for (const py::handle effector : items) effectors.push_back(checked_effector(effector));
    const Skeleton skeleton(as_span(parents));
    const auto of_bones = limits_of(locked, limits, stiffness, skeleton.bone_count());
    const bool has_pole = effectors.size() == 1 && effectors[0].has_pole;
    return std::make_unique<Solver>(Solver{IkSolver(skeleton, of_bones, effectors), has_pole});
}

/// `array` as float64 [.., count, numbers of a Value]: its last two axes are an item, the others broadcast.
template <class Value>
Input<double> of_each(const py::array_t<double>& array, const char* argument, std::size_t count,
                      const std::string& of_what) {
    auto input = checked_input<double, Value>(array, argument);
    take_last_axis(input, array, std::to_string(count) + " " + of_what + " before the last axes",
                   static_cast<py::ssize_t>(count));
    return input;
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
    py::object given = promoted<1>({argument}, {value})[0];
    if (py::isinstance<py::array_t<float>>(given)) given = in_order<double>(given);
    return with_layout(given, argument, axes, [&]<class Transform, class T>() {
        const auto input = checked_input<T, Transform>(given, argument);
        Output<DualQuat<double>> output(input.lead);
        const py::ssize_t count = count_of(input.lead);
        for (py::ssize_t i = 0; i < count; ++i) {
            const Transform transform = Item<Transform>::read(input.data + i * input.item_size);
            output.write(i, cast<double>(to_dual_quat(normalized(transform))));
        }
        return output.array;
    });
}

IkOptions checked_options(const py::object& tolerance, const py::object& iterations) {
    IkOptions options;
    const std::string positive = "a finite number above 0";
    options.tolerance = checked_number(tolerance, "tolerance", positive);
    if (!(options.tolerance > 0.0) || !std::isfinite(options.tolerance)) {
        fail("tolerance", positive, std::to_string(options.tolerance));
    }
    options.iterations = static_cast<int>(
        checked_integer(iterations, "iterations", "a whole number, 0 to 1000000", 1'000'000));
    return options;
}

Solution solve(Solver& self, const ArrayLike& rest, const ArrayLike& tips, const ArrayLike& goals,
               const OptionalArrayLike& poles, const OptionalArrayLike& rotations,
               const OptionalArrayLike& root, const Number& tolerance, const Index& iterations) {
    const IkOptions options = checked_options(tolerance, iterations);
    const std::size_t bones = self.solver.bone_count();
    const std::size_t effectors = self.solver.effector_count();
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
            read_rows(inputs[input], item, common, values);
        };
        for (py::ssize_t i = 0; i < count; ++i) {
            read(0, i, parent_from_rest);
            read(1, i, offsets);
            read(2, i, wanted);
            read(3, i, own);
            for (Quat<double>& q : own) {
                const double length = glm::length(q);
                q = length > 0.0 && std::isfinite(length) ? q / length : Quat<double>(1.0, Vec3<double>(0.0));
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
    return named_tuple("Solution", py::make_tuple(solved.take(), of[0], of[1], steps, of[2]));
}

}  // namespace

void bind_ik(py::module_& m) {
    auto ik = m.def_submodule("ik");
    def<Quat>(
        ik, "swing_twist_angles", {"rotations"},
        []<class T>(const Quat<T>& q) {
            return Vec3<T>(swing_twist_angles(glm::normalize(Quat<double>(q))));
        },
        R"(The angles that limits bound, [.., 3], radians. A rotation is decomposed into a twist about y, by the
angle y, followed by a swing without twist; x and z are twice the arcsines of the x and z of its quaternion,
so that for a swing about x alone x is its angle.

rotations: [.., 4]; signs and lengths do not matter. For a swing by 180 degrees the twist is 0.)");
    py::class_<Solver>(
        ik, "Solver",
        "A solver for one tree of bones with its limits and effectors. solve() allocates only its result.")
        .def(py::init(&make), "parents"_a, "effectors"_a, py::kw_only(), "locked"_a = py::none(),
             "limits"_a = py::none(), "stiffness"_a = py::none(),
             R"(parents: int32 [bones], the index of each bone's parent, -1 for a root; parents precede their
    children.
effectors: at least one.
locked: bool [bones, 3], axes x, y (along the bone) and z about which a bone does not rotate.
limits: [bones, 3, 2], the smallest and the largest angle about x, y and z, radians, with -pi <= smallest <= 0
    <= largest <= pi; (-inf, inf) for no limit. The angles are those of swing_twist_angles(), as for Blender's
    IK limits. With limits of x and z a bone's swing stays within an ellipse through the four. Bones with
    limits or locks swing by at most 177.7 degrees.
stiffness: [bones, 3], 0 to below 1: how much less the bone rotates about an axis than about others.)")
        .def(
            "solve", &solve, "rest"_a, "tips"_a, "goals"_a, "poles"_a = py::none(), py::kw_only(),
            "rotations"_a = py::none(), "root"_a = py::none(), "tolerance"_a = 1e-6, "iterations"_a = 100,
            R"(Finds rotations that bring the tips to the goals, by damped least squares on screws; each step moves all
axes (Wampler 1986; Sugihara 2011).

rest: [.., bones, 4, 4], [.., bones, 3, 4], [.., bones, 7] or [.., bones, 8]: each bone relative to its
    parent, not rotated. A matrix's linear part is replaced by the nearest rotation.
tips: [.., effectors, 3], each in the space of its bone.
goals: [.., effectors, ..], in any of these layouts: the goals of each tip's position and of its bone's
    rotation.
poles: [.., effectors, 3], points; None if no effector has a pole.
rotations: [.., bones, 4], the start; rotations beyond the limits are brought within. None: no rotation.
root: [.., 4, 4], [.., 3, 4], [.., 7] or [.., 8], applied after the transform of every bone without a parent;
    None: the identity. Goals and poles are in the space that it maps to.
tolerance: errors that count as reached, in lengths of the longest chain and in radians.
iterations: maximum number of steps.

If a chain with one effector whose rotation does not count can not reach its goal, the goal is moved to the
nearest point of its range; a chain without limits stretches straight towards it. A straight chain that points
at a nearer goal is bent a little about its first free axis. A pole on the line from root to goal is ignored.
Limits can cause local minima: the result is within limits, and no step improves it. A chain with one effector
is solved a second time, starting with a rotation to the goal, and the better result is used.)");
}

}  // namespace sinew::bindings
