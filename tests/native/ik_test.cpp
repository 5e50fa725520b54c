// SPDX-License-Identifier: GPL-3.0-or-later
// Protects what holds of every solution of inverse kinematics: limits, trees, poles, degenerate chains,
// invariance. tests/python/test_ik.py compares with scipy.
#include <algorithm>
#include <cstring>
#include <vector>

#include "sinew/ik/solver.h"
#include "support.h"

namespace sinew {
namespace {

/// By how many radians a rotation exceeds the limits of its bone: the largest excess of the three angles. A
/// locked axis must be at 0. If both x and z are limited, they are bounded by the ellipse through the four
/// limits, whose semi-axes are sines of half angles; an ellipse without width or height becomes a rectangle.
double limit_violation(const BoneLimits& limits, const Quat<double>& q) noexcept {
    const Vec3<double> angles = swing_twist_angles(q);
    double beyond = 0.0;
    for (int i = 0; i < 3; ++i) {
        const AxisLimit& limit = limits[static_cast<std::size_t>(i)];
        if (limit.is_locked) {
            beyond = std::max(beyond, std::abs(angles[i]));
        } else if (limit.is_limited) {
            beyond = std::max({beyond, limit.min - angles[i], angles[i] - limit.max});
        }
    }
    const AxisLimit& x = limits[0];
    const AxisLimit& z = limits[2];
    if (x.is_locked || z.is_locked || !x.is_limited || !z.is_limited) return beyond;
    const double half_x = std::sin(0.5 * (angles.x < 0.0 ? x.min : x.max));
    const double half_z = std::sin(0.5 * (angles.z < 0.0 ? z.min : z.max));
    if (std::abs(half_x) < 1e-9 || std::abs(half_z) < 1e-9) return beyond;
    const double radius = std::hypot(std::sin(0.5 * angles.x) / half_x, std::sin(0.5 * angles.z) / half_z);
    if (radius <= 1.0) return beyond;
    return std::max(beyond, (1.0 - 1.0 / radius) * std::hypot(angles.x, angles.z));
}

using test::Random;

/// Bones along y, each at the end of the one before, unless parents say otherwise.
struct Rig {
    std::vector<std::int32_t> parents;
    std::vector<DualQuat<double>> rest;
    std::vector<double> lengths;
    std::vector<BoneLimits> limits;

    static Rig chain(const std::vector<double>& lengths) {
        Rig rig;
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            rig.parents.push_back(static_cast<std::int32_t>(i) - 1);
            const double before = i > 0 ? lengths[i - 1] : 0.0;
            rig.rest.push_back(to_dual_quat(QuatVec<double>{{1, 0, 0, 0}, {0, before, 0}}));
        }
        rig.lengths = lengths;
        rig.limits.resize(lengths.size());
        return rig;
    }

    [[nodiscard]] double length() const {
        double sum = 0.0;
        for (const double each : lengths) sum += each;
        return sum;
    }

    /// The oracle for poses: matrices instead of the solver's dual quaternions.
    [[nodiscard]] std::vector<Affine<double>> poses(const std::vector<Quat<double>>& rotations) const {
        std::vector<Affine<double>> result;
        for (std::size_t i = 0; i < parents.size(); ++i) {
            const Affine<double> own =
                to_affine(rest[i]) * Affine<double>{to_mat3(rotations[i]), Vec3<double>(0.0)};
            result.push_back(parents[i] < 0 ? own : result[static_cast<std::size_t>(parents[i])] * own);
        }
        return result;
    }

    [[nodiscard]] Vec3<double> tip(const std::vector<Quat<double>>& rotations, std::size_t bone) const {
        return transform_point(poses(rotations)[bone], Vec3<double>(0.0, lengths[bone], 0.0));
    }
};

DualQuat<double> at(const Vec3<double>& position, const Quat<double>& rotation = {1, 0, 0, 0}) {
    return to_dual_quat(QuatVec<double>{rotation, position});
}

struct Solved {
    IkResult result;
    std::vector<Quat<double>> rotations;
};

Solved solve(const Rig& rig, const std::vector<IkEffector>& effectors,
             const std::vector<DualQuat<double>>& goals, std::vector<Quat<double>> rotations,
             const IkOptions& options = {}, const std::vector<Vec3<double>>& poles = {},
             const DualQuat<double>& root = {}) {
    IkSolver solver(Skeleton(rig.parents), rig.limits, effectors);
    std::vector<Vec3<double>> tips;
    for (const IkEffector& effector : effectors) {
        tips.emplace_back(0.0, rig.lengths[static_cast<std::size_t>(effector.bone)], 0.0);
    }
    const auto result = solver.solve({root, rig.rest, tips, goals, poles}, rotations, options);
    return {result.value(), rotations};
}

IkEffector last(const Rig& rig) { return {.bone = static_cast<std::int32_t>(rig.parents.size()) - 1}; }

std::vector<double> random_lengths(Random& random) {
    std::vector<double> lengths;
    const std::int32_t count = 2 + random.index(9);
    for (std::int32_t i = 0; i < count; ++i) lengths.push_back(random.uniform(0.5, 1.5));
    return lengths;
}

std::vector<Quat<double>> random_rotations(Random& random, std::size_t count, double angle) {
    std::vector<Quat<double>> rotations;
    for (std::size_t i = 0; i < count; ++i) {
        rotations.push_back(quat_from_rotation_vector(random.vector(angle)));
    }
    return rotations;
}

/// One of several kinds: none, hinges, elbows, swings without twist, boxes and ellipses.
BoneLimits random_limits(Random& random) {
    BoneLimits limits;
    for (AxisLimit& limit : limits) {
        const double kind = random.uniform(0.0, 1.0);
        limit.is_locked = kind < 0.3;
        limit.is_limited = kind > 0.6;
        limit.min = -random.uniform(0.1, 2.5);
        limit.max = random.uniform(0.1, 2.5);
    }
    if (limits[0].is_locked && limits[2].is_locked) limits[0].is_locked = false;
    return limits;
}

TEST(Ik, limits_are_never_violated_and_nearly_always_what_is_reachable_is_reached) {
    Random random(5);
    int reached = 0;

    for (int i = 0; i < 400; ++i) {
        Rig rig = Rig::chain(random_lengths(random));
        for (BoneLimits& limits : rig.limits) limits = random_limits(random);
        const std::size_t end = rig.parents.size() - 1;
        // Rotations within the limits, made by a solve without a step, which limits its start.
        const auto within = [&](const std::vector<Quat<double>>& any) {
            return solve(rig, {last(rig)}, {at({0, 0, 0})}, any, {.iterations = 0}).rotations;
        };
        const auto posed = within(random_rotations(random, end + 1, 1.5));
        for (std::size_t bone = 0; bone <= end; ++bone) {
            EXPECT_LT(limit_violation(rig.limits[bone], posed[bone]), 1e-7) << i << " " << bone;
        }
        const Vec3<double> goal = rig.tip(posed, end);
        const auto found =
            solve(rig, {last(rig)}, {at(goal)}, random_rotations(random, end + 1, 0.3), {.iterations = 200});
        for (std::size_t bone = 0; bone <= end; ++bone) {
            EXPECT_LT(limit_violation(rig.limits[bone], found.rotations[bone]), 1e-7) << i << " " << bone;
        }
        reached += found.result.is_reached;
    }
    RecordProperty("reached", reached);
    EXPECT_GE(reached, 390);
}

/// A trunk of two bones, and two branches of three bones each.
Rig tree() {
    Rig rig;
    rig.parents = {-1, 0, 1, 2, 3, 1, 5, 6};
    rig.lengths = {1, 1, 0.5, 1, 1, 0.5, 1, 1};
    for (std::size_t i = 0; i < rig.parents.size(); ++i) {
        const double before = i > 0 ? rig.lengths[static_cast<std::size_t>(rig.parents[i])] : 0.0;
        const double side = i == 2 ? 60.0 : i == 5 ? -60.0 : 0.0;
        rig.rest.push_back(at({0, before, 0}, test::about(Vec3<double>(0, 0, 1), side)));
    }
    rig.limits.resize(rig.parents.size());
    return rig;
}

TEST(Ik, trees_reach_two_goals) {
    Random random(7);
    const Rig rig = tree();
    for (int i = 0; i < 100; ++i) {
        const auto posed = random_rotations(random, 8, 0.6);
        const std::vector<Vec3<double>> goals{rig.tip(posed, 4), rig.tip(posed, 7)};
        const auto found = solve(rig, {{.bone = 4}, {.bone = 7}}, {at(goals[0]), at(goals[1])},
                                 random_rotations(random, 8, 0.3), {.iterations = 5000});
        EXPECT_LT(test::distance(rig.tip(found.rotations, 4), goals[0]), 4.5e-6) << i;
        EXPECT_LT(test::distance(rig.tip(found.rotations, 7), goals[1]), 4.5e-6) << i;
    }
}

TEST(Ik, poles_choose_the_plane_and_the_side_of_the_bend) {
    Random random(8);
    for (int i = 0; i < 200; ++i) {
        // Bent about x, so that its plane contains z, the axis that the pole angle refers to.
        const Rig rig = Rig::chain(random_lengths(random));
        const std::size_t end = rig.parents.size() - 1;
        const std::vector<Quat<double>> start(end + 1,
                                              quat_from_rotation_vector(Vec3<double>(0.15, 0.0, 0.0)));
        const Vec3<double> towards = unit(random.vector(1.0), {1, 0, 0});
        const Vec3<double> goal = random.uniform(0.5, 0.9) * rig.length() * towards;
        const Vec3<double> pole = 3.0 * unit(random.vector(1.0), {0, 1, 0});
        IkEffector effector = last(rig);
        effector.has_pole = true;
        effector.pole_angle = 0.5 * std::numbers::pi;
        const auto found = solve(rig, {effector}, {at(goal)}, start, {.iterations = 5000}, {pole});
        EXPECT_TRUE(found.result.is_reached);
        const Vec3<double> up = glm::normalize(pole - glm::dot(pole, towards) * towards);
        const Vec3<double> normal = glm::cross(towards, up);
        for (std::size_t bone = 0; bone < end; ++bone) {
            EXPECT_NEAR(glm::dot(rig.tip(found.rotations, bone), normal), 0.0, 1e-9);
        }
        // The chain is bent away from the direction of its bones' z axes.
        EXPECT_LT(glm::dot(rig.tip(found.rotations, 0), up), 0.0) << i;
    }
}

TEST(Ik, a_straight_chain_bends_to_a_goal_on_its_line) {
    for (const double goal : {0.3, 1.0, 2.0, -0.5, -2.0}) {
        Rig rig = Rig::chain({1, 1, 1});
        const std::vector<Quat<double>> straight(3, Quat<double>(1, 0, 0, 0));
        const auto found = solve(rig, {last(rig)}, {at({0, goal, 0})}, straight, {.iterations = 5000});
        EXPECT_LT(test::distance(rig.tip(found.rotations, 2), {0, goal, 0}), 3e-6) << goal;
        // A knee: bends only to one side.
        for (std::size_t bone : {1, 2}) {
            for (std::size_t axis : {1, 2}) rig.limits[bone][axis].is_locked = true;
            rig.limits[bone][0].is_limited = true;
            rig.limits[bone][0].min = 0.0;
            rig.limits[bone][0].max = 2.6;
        }
        const auto knee = solve(rig, {last(rig)}, {at({0, goal, 0})}, straight, {.iterations = 5000});
        EXPECT_LT(test::distance(rig.tip(knee.rotations, 2), {0, goal, 0}), 3e-6) << goal;
        for (std::size_t bone : {1, 2}) {
            EXPECT_LT(limit_violation(rig.limits[bone], knee.rotations[bone]), 1e-7);
        }
    }
}

TEST(Ik, degenerate_chains_are_finite) {
    const std::vector<Quat<double>> straight(3, Quat<double>(1, 0, 0, 0));
    for (const std::vector<double>& lengths :
         {std::vector<double>{0, 0, 0}, {1, 0, 1}, {0, 1, 0}, {3, 1, 0.5}, {1, 1, 1}}) {
        for (const Vec3<double>& goal : {Vec3<double>(0, 0, 0), {0, 0.4, 0}, {1, 1, 0}, {1e9, 0, 0}}) {
            const Rig rig = Rig::chain(lengths);
            IkEffector effector = last(rig);
            effector.has_pole = true;
            const auto found =
                solve(rig, {effector}, {at(goal)}, straight, {.iterations = 2000}, {{0, 5, 0}});
            for (const Quat<double>& q : found.rotations) EXPECT_NEAR(glm::length(q), 1.0, 1e-9);
            EXPECT_TRUE(std::isfinite(found.result.distance));
            double least = test::distance(goal, Vec3<double>(0.0)) - rig.length();
            least = std::max(least, 2.0 * *std::max_element(lengths.begin(), lengths.end()) - rig.length() -
                                        test::distance(goal, Vec3<double>(0.0)));
            EXPECT_LE(found.result.distance, std::max(least, 0.0) * (1 + 1e-9) + 1e-4 * rig.length())
                << lengths[0] << lengths[1] << lengths[2] << " " << goal.x << " " << goal.y;
        }
    }
}

TEST(Ik, a_rigid_motion_of_everything_changes_nothing) {
    Random random(9);
    for (int i = 0; i < 100; ++i) {
        const Rig rig = Rig::chain({1, 1.2, 0.8, 0.6});
        const DualQuat<double> motion = to_dual_quat(random.motion(3.0));
        const DualQuat<double> goal = at(random.vector(1.5), random.rotation());
        const Vec3<double> pole = random.vector(4.0);
        const auto start = random_rotations(random, 4, 0.4);
        const IkEffector effector{.bone = 3, .rotation_weight = i % 2 ? 0.5 : 0.0, .has_pole = i % 3 == 0};
        const auto here = solve(rig, {effector}, {goal}, start, {.iterations = 30}, {pole});
        const auto there = solve(rig, {effector}, {motion * goal}, start, {.iterations = 30},
                                 {transform_point(motion, pole)}, motion);
        for (std::size_t bone = 0; bone < 4; ++bone) {
            EXPECT_LT(angle_between(here.rotations[bone], there.rotations[bone]), 1e-5) << i << " " << bone;
        }
    }
}

TEST(Ik, signs_of_quaternions_do_not_matter_and_the_same_gives_the_same_bits) {
    Random random(10);
    for (int i = 0; i < 100; ++i) {
        Rig rig = Rig::chain({1, 1.2, 0.8});
        for (BoneLimits& limits : rig.limits) {
            if (i % 2) limits = random_limits(random);
        }
        const auto start = random_rotations(random, 3, 1.5);
        std::vector<Quat<double>> negative;
        for (const Quat<double>& q : start) negative.push_back(-q);
        const DualQuat<double> goal = at(random.vector(1.5), random.rotation());
        const IkEffector effector{.bone = 2, .rotation_weight = 0.5};
        const auto once = solve(rig, {effector}, {goal}, start);
        const auto again = solve(rig, {effector}, {-goal}, negative);
        const auto same = solve(rig, {effector}, {goal}, start);
        for (std::size_t bone = 0; bone < 3; ++bone) {
            EXPECT_LT(glm::length(once.rotations[bone] - again.rotations[bone]), 1e-9) << i;
            EXPECT_GE(once.rotations[bone].w, 0.0);
        }
        EXPECT_EQ(std::memcmp(once.rotations.data(), same.rotations.data(), 3 * sizeof(Quat<double>)), 0);
    }
}

TEST(Ik, stiff_bones_rotate_less) {
    Rig rig = Rig::chain({1, 1, 1});
    const std::vector<Quat<double>> start(3, quat_from_rotation_vector(Vec3<double>(0.2, 0, 0)));
    const auto turn_of_root = [&] {
        const auto found = solve(rig, {last(rig)}, {at({0.5, 2, 1})}, start, {.iterations = 5000});
        EXPECT_TRUE(found.result.is_reached);
        return angle_between(start[0], found.rotations[0]);
    };
    for (AxisLimit& limit : rig.limits[0]) limit.stiffness = 0.0;
    const double loose = turn_of_root();
    for (AxisLimit& limit : rig.limits[0]) limit.stiffness = 0.9;
    EXPECT_LT(turn_of_root(), 0.7 * loose);
}

TEST(IkSolver, solves_nothing_where_sizes_do_not_fit) {
    const Rig rig = Rig::chain({1.0, 1.0});
    const IkSolver solver(Skeleton(rig.parents), rig.limits, std::vector{last(rig)});
    const std::vector<Vec3<double>> tips{{0.0, 1.0, 0.0}};
    const std::vector<DualQuat<double>> goals(1);
    std::vector<Quat<double>> rotations(2, Quat<double>(1.0, 0.0, 0.0, 0.0));
    EXPECT_TRUE(solver.solve({{}, rig.rest, tips, goals, {}}, rotations));
    const auto start = rotations;
    EXPECT_FALSE(solver.solve({{}, std::span(rig.rest).first(1), tips, goals, {}}, rotations));
    EXPECT_FALSE(solver.solve({{}, rig.rest, {}, goals, {}}, rotations));
    EXPECT_FALSE(solver.solve({{}, rig.rest, tips, {}, {}}, rotations));
    EXPECT_FALSE(solver.solve({{}, rig.rest, tips, goals, {}}, std::span(rotations).first(1)));
    EXPECT_EQ(rotations, start);
}

}  // namespace
}  // namespace sinew
