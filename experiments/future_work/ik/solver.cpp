// SPDX-License-Identifier: GPL-3.0-or-later
//
// Damped least squares on screws. Each free axis of a bone is a unit screw, a line in the space of the root; a
// small rotation about it moves a tip with the screw's velocity at that point, which is its column of the
// Jacobian J. A step is W J^T (J W J^T + l 1)^-1 e, a system with as many equations as there are errors e, not
// axes; W contains the stiffness. l follows the error (Sugihara 2011), so steps near a goal are Newton steps, and
// steps towards unreachable goals do not oscillate. A step that increases the error is undone (Levenberg 1944,
// Marquardt 1963). Axes at a limit that a step would exceed are left out of that step.
#include "future_work/ik/solver.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include "sinew/base/fail.h"
#include "sinew/base/fork_safe.h"
#include "sinew/transform/twist.h"

namespace sinew {
namespace {

constexpr double kLeastDamping = 1e-12;
// A cost that a step lowers by less than this, relative to the cost, is at its minimum.
constexpr double kStagnation = 1e-9;
// A cost whose squared slope is less than this share of it can not be lowered, however large it is: a saddle.
constexpr double kLevel = 1e-7;
// Radians. Larger steps run into limits that smaller ones would move around.
constexpr double kLargestStep = 0.4;
constexpr double kAtBoundary = 1e-12;
constexpr int kMaxBlockings = 8;

Vec3<double> unit_axis(std::size_t axis) noexcept {
    Vec3<double> v(0.0);
    v[static_cast<int>(axis)] = 1.0;
    return v;
}

/// The smallest cosine of half a swing about two axes, unless both are free and without limits: 177.7 degrees. At
/// 180 degrees the two coordinates are singular.
constexpr double kLeastSwing = 0.02;

/// How often a solve bends a chain that points straight at its goal.
constexpr int kMaxBends = 3;

void check(const BoneLimits& limits, std::size_t bone) {
    for (const AxisLimit& limit : limits) {
        constexpr double kHalfTurn = std::numbers::pi + 1e-6;
        const bool is_range =
            limit.min <= 0.0 && limit.max >= 0.0 && limit.min >= -kHalfTurn && limit.max <= kHalfTurn;
        if (limit.is_limited && !is_range) {
            fail("limits", "-pi <= min <= 0 <= max <= pi",
                 std::to_string(limit.min) + " and " + std::to_string(limit.max) + " for bone " +
                     std::to_string(bone));
        }
        if (!(limit.stiffness >= 0.0 && limit.stiffness < 1.0)) {
            fail("stiffness", "0 to below 1",
                 std::to_string(limit.stiffness) + " for bone " + std::to_string(bone));
        }
    }
}

void check(const IkEffector& effector, std::size_t index, std::size_t bone_count) {
    const std::string where = " for effector " + std::to_string(index);
    if (effector.bone < 0 || static_cast<std::size_t>(effector.bone) >= bone_count) {
        fail("effectors", "the index of one of " + std::to_string(bone_count) + " bones",
             std::to_string(effector.bone) + where);
    }
    for (const double weight : {effector.position_weight, effector.rotation_weight}) {
        if (!(weight >= 0.0) || !std::isfinite(weight)) {
            fail("weights", "finite ones not below 0", std::to_string(weight) + where);
        }
    }
    if (!std::isfinite(effector.pole_angle)) {
        fail("pole_angle", "a finite one", std::to_string(effector.pole_angle) + where);
    }
}

double wrapped(double angle) noexcept { return std::remainder(angle, 2.0 * std::numbers::pi); }

/// A bone of the solver.
///
/// is_ball    no limit and no lock: the rotation is stored as a quaternion. Otherwise three coordinates represent
///            it: the angle of the twist about y; and for the swing, about one axis the angle, about two axes the
///            x and z of its quaternion
/// low, high  range of the coordinates
struct IkBone {
    std::int32_t parent = -1;
    bool moves = false;
    bool is_ball = true;
    bool swings_about_two = false;
    bool has_ellipse = false;
    std::array<bool, 3> is_free{true, true, true};
    std::array<double, 3> low{};
    std::array<double, 3> high{};
    std::array<double, 3> weight{1.0, 1.0, 1.0};

    Quat<double> rotation{1.0, Vec3<double>(0.0)};
    Vec3<double> coordinates{0.0};
    DualQuat<double> parent_from_rest;

    /// Before and after the bone's own rotation; in the space of the root, lengths divided by that of the longest
    /// chain.
    DualQuat<double> root_from_rest;
    DualQuat<double> root_from_bone;
    Vec3<double> head{0.0};

    void set_rotation(const Quat<double>& either) noexcept {
        const Quat<double> q = either.w < 0.0 ? -either : either;
        if (is_ball) {
            rotation = glm::normalize(q);
            return;
        }
        // Without the other axes, the nearest rotation about the one axis; otherwise a twist and then a swing.
        const bool has_swing = is_free[0] || is_free[2];
        const double length = std::hypot(q.w, q.y);
        const bool untwists = has_swing && is_free[1] && length > 0.0;
        const bool splits = swings_about_two ? length > 0.0 : untwists;
        const double cosine = splits ? q.w / length : 1.0;
        const double sine = splits ? q.y / length : 0.0;
        const double x = q.x * cosine + q.z * sine;
        const double z = q.z * cosine - q.x * sine;
        const double w = splits ? length : q.w;
        Vec3<double> c(0.0);
        c.y = is_free[1] ? wrapped(2.0 * std::atan2(q.y, q.w)) : 0.0;
        if (swings_about_two) {
            c.x = w < 0.0 ? -x : x;
            c.z = w < 0.0 ? -z : z;
        } else {
            if (is_free[0]) c.x = wrapped(2.0 * std::atan2(x, w));
            if (is_free[2]) c.z = wrapped(2.0 * std::atan2(z, w));
        }
        set_coordinates(c);
    }

    void set_coordinates(const Vec3<double>& values) noexcept {
        Vec3<double> c = values;
        for (int i = 0; i < 3; ++i) {
            const auto axis = static_cast<std::size_t>(i);
            c[i] = is_free[axis] ? std::clamp(c[i], low[axis], high[axis]) : 0.0;
        }
        Quat<double> swing(1.0, Vec3<double>(0.0));
        if (swings_about_two) {
            if (has_ellipse) {
                const double half_x = c.x < 0.0 ? low[0] : high[0];
                const double half_z = c.z < 0.0 ? low[2] : high[2];
                if (std::abs(half_x) > 1e-9 && std::abs(half_z) > 1e-9) {
                    const double radius = std::hypot(c.x / half_x, c.z / half_z);
                    if (radius > 1.0) {
                        c.x /= radius;
                        c.z /= radius;
                    }
                }
            }
            const double most = 1.0 - kLeastSwing * kLeastSwing;
            const double square = c.x * c.x + c.z * c.z;
            if (square > most) {
                c.x *= std::sqrt(most / square);
                c.z *= std::sqrt(most / square);
            }
            swing = Quat<double>(std::sqrt(1.0 - c.x * c.x - c.z * c.z), {c.x, 0.0, c.z});
        } else {
            // At most one of the two is not 0.
            const double half = 0.5 * (c.x + c.z);
            swing = Quat<double>(std::cos(half),
                                 {is_free[0] ? std::sin(half) : 0.0, 0.0, is_free[2] ? std::sin(half) : 0.0});
        }
        coordinates = c;
        rotation = swing * Quat<double>(std::cos(0.5 * c.y), {0.0, std::sin(0.5 * c.y), 0.0});
    }

    /// Rotates the bone further by `axis`, a rotation vector in the space of the root, as far as its limits
    /// allow.
    void rotate_by(const Vec3<double>& axis) noexcept {
        const Quat<double>& before = root_from_rest.real;
        const Quat<double> own = glm::conjugate(before) * quat_from_rotation_vector(axis) * before;
        set_rotation(own * rotation);
    }
};

IkBone make_bone(const BoneLimits& limits, std::int32_t parent) {
    IkBone bone;
    bone.parent = parent;
    for (std::size_t i = 0; i < 3; ++i) {
        bone.is_free[i] = !limits[i].is_locked;
        bone.weight[i] = 1.0 - limits[i].stiffness;
        bone.is_ball = bone.is_ball && !limits[i].is_locked && !limits[i].is_limited;
    }
    bone.swings_about_two = bone.is_free[0] && bone.is_free[2];
    bone.has_ellipse = bone.swings_about_two && limits[0].is_limited && limits[2].is_limited;
    for (std::size_t i = 0; i < 3; ++i) {
        const bool is_sine = i != 1 && bone.swings_about_two;
        const auto coordinate = [is_sine](double angle) { return is_sine ? std::sin(0.5 * angle) : angle; };
        const double most = is_sine ? 1.0 : std::numeric_limits<double>::infinity();
        bone.low[i] = limits[i].is_limited ? coordinate(limits[i].min) : -most;
        bone.high[i] = limits[i].is_limited ? coordinate(limits[i].max) : most;
    }
    return bone;
}

/// A free axis of a bone: its screw, and the speed of rotation for a change of its coordinate.
struct IkAxis {
    std::size_t bone;
    std::size_t axis;
    Twist<double> screw;
    double speed = 1.0;
    Vec3<double> along{0.0};  ///< the coordinates that a step changes: its own, or both along a boundary
    bool is_blocked = false;
};

struct IkTip {
    IkEffector effector;
    std::size_t bone;
    std::size_t root;
    std::vector<std::size_t> chain;  ///< bones, starting at the root
    std::vector<bool> is_moved_by;   ///< [bones]
    double reach = 0.0;              ///< for this solve, in lengths of the longest chain
    Vec3<double> offset{0.0};        ///< in the space of the bone
    Vec3<double> position{0.0};
    Quat<double> rotation{1.0, Vec3<double>(0.0)};
    Vec3<double> goal{0.0};
    Quat<double> goal_rotation{1.0, Vec3<double>(0.0)};
};

}  // namespace

struct IkSolver::State {
    State(const Skeleton& skeleton, std::span<const BoneLimits> limits,
          std::span<const IkEffector> effectors) {
        const std::size_t bone_count = skeleton.bone_count();
        if (!limits.empty() && limits.size() != bone_count) {
            fail("limits", "those of " + std::to_string(bone_count) + " bones",
                 std::to_string(limits.size()));
        }
        if (effectors.empty()) fail("effectors", "at least one", "none");
        for (std::size_t i = 0; i < bone_count; ++i) {
            const BoneLimits own = limits.empty() ? BoneLimits{} : limits[i];
            check(own, i);
            bones.push_back(make_bone(own, skeleton.parents()[i]));
        }
        for (std::size_t i = 0; i < effectors.size(); ++i) {
            check(effectors[i], i, bone_count);
            IkTip tip{.effector = effectors[i],
                      .bone = static_cast<std::size_t>(effectors[i].bone),
                      .root = 0,
                      .chain = {},
                      .is_moved_by = std::vector<bool>(bone_count)};
            for (std::int32_t at = effectors[i].bone; at >= 0;
                 at = bones[static_cast<std::size_t>(at)].parent) {
                tip.root = static_cast<std::size_t>(at);
                tip.chain.insert(tip.chain.begin(), tip.root);
                tip.is_moved_by[tip.root] = true;
                bones[tip.root].moves = true;
            }
            row_count += (tip.effector.position_weight > 0.0 ? 3u : 0u) +
                         (tip.effector.rotation_weight > 0.0 ? 3u : 0u);
            tips.push_back(std::move(tip));
        }
        has_pole = effectors.size() == 1 && effectors[0].has_pole;
        for (std::size_t bone = 0; bone < bone_count; ++bone) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (bones[bone].moves && bones[bone].is_free[axis]) axes.push_back({bone, axis, {}});
            }
        }
        columns.resize(axes.size() * row_count);
        steps.resize(axes.size());
        gradient.resize(axes.size());
        residual.resize(row_count);
        solution.resize(row_count);
        normal.resize(row_count * row_count);
        for (Pose* pose : {&first, &kept, &best}) {
            pose->rotations.resize(bone_count);
            pose->coordinates.resize(bone_count);
        }
    }

    ForkSafeMutex mutex;  ///< as all that follows is scratch of one solve
    std::vector<IkBone> bones;
    std::vector<IkTip> tips;
    std::vector<IkAxis> axes;
    std::size_t row_count = 0;
    bool has_pole = false;
    double length = 1.0;  ///< of the longest chain
    Vec3<double> pole{0.0};

    std::vector<double> columns;  ///< [axes, rows]
    std::vector<double> residual, solution, normal;
    std::vector<double> steps, gradient;

    /// Of all bones.
    struct Pose {
        std::vector<Quat<double>> rotations;
        std::vector<Vec3<double>> coordinates;
    };
    Pose first, kept, best;

    void start(const IkProblem& problem, std::span<const Quat<double>> rotations) noexcept {
        double longest = 0.0;
        for (std::size_t i = 0; i < tips.size(); ++i) {
            IkTip& tip = tips[i];
            tip.offset = problem.tips[i];
            tip.reach = safe_length(tip.offset);
            for (std::size_t k = 1; k < tip.chain.size(); ++k) {
                tip.reach += safe_length(translation(problem.parent_from_rest[tip.chain[k]]));
            }
            longest = std::max(longest, tip.reach);
        }
        length = longest > 0.0 && std::isfinite(longest) ? longest : 1.0;
        const double scale = 1.0 / length;
        for (std::size_t i = 0; i < bones.size(); ++i) {
            bones[i].parent_from_rest = problem.parent_from_rest[i];
            bones[i].parent_from_rest.dual *= scale;
            bones[i].set_rotation(rotations[i]);
        }
        const DualQuat<double> root_from_space = inverse(problem.space_from_root);
        for (std::size_t i = 0; i < tips.size(); ++i) {
            IkTip& tip = tips[i];
            const DualQuat<double> goal = root_from_space * problem.goals[i];
            tip.goal = scale * translation(goal);
            // Always the same sign, so that both signs of the goal give the same bits.
            tip.goal_rotation = goal.real.w < 0.0 ? -goal.real : goal.real;
            tip.offset *= scale;
            tip.reach *= scale;
        }
        if (has_pole) pole = scale * transform_point(root_from_space, problem.poles[0]);
        update();
        if (tips.size() != 1 || !(tips[0].effector.position_weight > 0.0)) return;
        const bool was_moved = tips[0].effector.rotation_weight == 0.0 && move_goal_within_reach();
        if (has_pole) rotate_to_pole();
        if (was_moved) stretch();
    }

    /// Updates the poses of all bones that move, and the tips.
    void update() noexcept {
        for (IkBone& bone : bones) {
            if (!bone.moves) continue;
            bone.root_from_rest =
                bone.parent < 0
                    ? bone.parent_from_rest
                    : bones[static_cast<std::size_t>(bone.parent)].root_from_bone * bone.parent_from_rest;
            // A product with a quaternion only: the bone rotates about its own head.
            bone.root_from_bone = {bone.root_from_rest.real * bone.rotation,
                                   bone.root_from_rest.dual * bone.rotation};
            bone.head = translation(bone.root_from_rest);
        }
        for (IkTip& tip : tips) {
            const IkBone& bone = bones[tip.bone];
            tip.rotation = bone.root_from_bone.real;
            tip.position = bone.head + rotate(tip.rotation, tip.offset);
        }
    }

    /// The rotation vector from the tip's rotation to its goal's.
    [[nodiscard]] static Vec3<double> rotation_error(const IkTip& tip) noexcept {
        return rotation_vector(tip.goal_rotation * glm::conjugate(tip.rotation));
    }
    /// Half the sum of squared errors.
    [[nodiscard]] double cost() const noexcept {
        double sum = 0.0;
        for (const IkTip& tip : tips) {
            if (tip.effector.position_weight > 0.0) {
                const Vec3<double> error = tip.effector.position_weight * (tip.goal - tip.position);
                sum += glm::dot(error, error);
            }
            if (tip.effector.rotation_weight > 0.0) {
                const Vec3<double> error = tip.effector.rotation_weight * rotation_error(tip);
                sum += glm::dot(error, error);
            }
        }
        return 0.5 * sum;
    }

    [[nodiscard]] bool is_reached(double tolerance) const noexcept {
        for (const IkTip& tip : tips) {
            if (tip.effector.position_weight > 0.0 && !(safe_length(tip.goal - tip.position) <= tolerance)) {
                return false;
            }
            if (tip.effector.rotation_weight > 0.0 && !(safe_length(rotation_error(tip)) <= tolerance)) {
                return false;
            }
        }
        return true;
    }

    void keep(Pose& pose) const noexcept {
        for (std::size_t i = 0; i < bones.size(); ++i) {
            pose.rotations[i] = bones[i].rotation;
            pose.coordinates[i] = bones[i].coordinates;
        }
    }

    void restore(const Pose& pose) noexcept {
        for (std::size_t i = 0; i < bones.size(); ++i) {
            bones[i].rotation = pose.rotations[i];
            bones[i].coordinates = pose.coordinates[i];
        }
        update();
    }

    /// Returns the number of iterations.
    int run(const IkOptions& options) noexcept {
        double error = cost();
        double least = error;
        double damping = 1.0;
        int bends = 0;
        int iteration = 0;
        keep(best);
        while (iteration < options.iterations && !is_reached(options.tolerance)) {
            ++iteration;
            update_axes();
            update_columns();
            update_residual();
            block_axes();
            double slope = 0.0;
            for (const double of_axis : gradient) slope += of_axis * of_axis;
            if (bends < kMaxBends && slope < kLevel * error) {
                ++bends;
                if (error < least) {
                    least = error;
                    keep(best);
                }
                bend();
                error = cost();
                continue;
            }
            keep(kept);
            double found = error;
            bool is_better = false;
            for (int attempt = 0; attempt < 12 && !is_better; ++attempt) {
                for (int blocking = 0; blocking < kMaxBlockings; ++blocking) {
                    if (!find_steps(damping * error + kLeastDamping)) break;
                    if (!block_steps()) break;
                }
                take_steps();
                found = cost();
                is_better = found < error;
                if (!is_better) {
                    damping = 8.0 * std::max(damping, 1e-3);
                    restore(kept);
                }
            }
            if (!is_better) break;
            damping *= 0.25;
            const double gain = error - found;
            error = found;
            if (gain < kStagnation * found) break;
        }
        if (bends > 0 && least < error) restore(best);
        return iteration;
    }

    /// For a second try, if a chain has folded onto itself on the way to a goal behind it.
    [[nodiscard]] bool can_rotate_to_goal() const noexcept {
        return tips.size() == 1 && !has_pole && tips[0].effector.position_weight > 0.0 &&
               tips[0].chain.size() > 1;
    }

    void rotate_to_goal() noexcept {
        const IkTip& tip = tips[0];
        IkBone& root = bones[tip.root];
        const Vec3<double> now = tip.position - root.head;
        const Vec3<double> wanted = tip.goal - root.head;
        const Vec3<double> axis = unit(glm::cross(now, wanted), Vec3<double>(0.0));
        root.rotate_by(std::atan2(safe_length(glm::cross(now, wanted)), glm::dot(now, wanted)) * axis);
        update();
    }

    /// Bends straight chains a little, if no axis moves a tip nearer to its goal.
    void bend() noexcept {
        constexpr double kBend = 0.1;
        for (const IkTip& tip : tips) {
            const std::size_t count = tip.chain.size();
            if (count < 2) continue;
            const Vec3<double> line =
                unit(tip.position - bones[tip.root].head,
                     rotate(bones[tip.root].root_from_bone.real, Vec3<double>(0.0, 1.0, 0.0)));
            Vec3<double> axis(0.0);
            double side = 1.0;
            if (has_pole) axis = unit(glm::cross(line, pole - bones[tip.root].head), Vec3<double>(0.0));
            // Otherwise the first free axis across the chain.
            for (const IkAxis& free : axes) {
                if (axis != Vec3<double>(0.0)) break;
                if (!tip.is_moved_by[free.bone] || free.bone == tip.root) continue;
                const Vec3<double> across = free.screw.angular - glm::dot(free.screw.angular, line) * line;
                if (glm::dot(across, across) < 0.25) continue;
                axis = glm::normalize(across);
                const IkBone& bone = bones[free.bone];
                const double at = bone.coordinates[static_cast<int>(free.axis)];
                if (!bone.is_ball && bone.high[free.axis] - at > at - bone.low[free.axis]) side = -1.0;
            }
            // Bends the chain to an arc and rotates its tip off the line: a goal on the other side of the root pulls
            // only then, and the chain must not have folded by that time.
            const bool is_behind = glm::dot(line, tip.goal - bones[tip.root].head) < 0.0;
            const double of_root = is_behind ? 0.5 * std::numbers::pi : kBend * static_cast<double>(count);
            for (std::size_t k = 0; k < count; ++k) {
                bones[tip.chain[k]].rotate_by(side * (k == 0 ? of_root : -kBend) * axis);
            }
        }
        update();
    }

    bool move_goal_within_reach() noexcept {
        IkTip& tip = tips[0];
        const Vec3<double>& root = bones[tip.root].head;
        double longest = safe_length(tip.offset);
        for (std::size_t k = 1; k < tip.chain.size(); ++k) {
            longest = std::max(longest, safe_length(translation(bones[tip.chain[k]].parent_from_rest)));
        }
        const double nearest = std::max(2.0 * longest - tip.reach, 0.0);
        const Vec3<double> wanted = tip.goal - root;
        const double distance = safe_length(wanted);
        if (distance > tip.reach) {
            tip.goal = root + (tip.reach / distance) * wanted;
            return true;
        }
        if (distance < nearest) {
            const Vec3<double> own = unit(tip.position - root, Vec3<double>(0.0, 1.0, 0.0));
            tip.goal = root + nearest * (distance > 1e-9 ? wanted / distance : own);
        }
        return false;
    }

    void rotate_to_pole() noexcept {
        const IkTip& tip = tips[0];
        IkBone& root = bones[tip.root];
        const auto frame = [](const Vec3<double>& along, const Vec3<double>& up, Mat3<double>& result) {
            const Vec3<double> y = unit(along, Vec3<double>(0.0));
            const Vec3<double> x = up - glm::dot(up, y) * y;
            const double length_of_x = safe_length(x);
            if (!(length_of_x > 1e-9 * safe_length(up)) || y == Vec3<double>(0.0)) return false;
            result = Mat3<double>(x / length_of_x, y, glm::cross(x / length_of_x, y));
            return true;
        };
        const double angle = tip.effector.pole_angle;
        const Vec3<double> axis =
            rotate(root.root_from_bone.real, Vec3<double>(std::cos(angle), 0.0, std::sin(angle)));
        Mat3<double> now, wanted;
        if (!frame(tip.position - root.head, axis, now)) return;
        if (!frame(tip.goal - root.head, pole - root.head, wanted)) return;
        const Quat<double> across = to_quat(wanted * glm::transpose(now));
        const Quat<double>& before = root.root_from_rest.real;
        root.set_rotation(glm::conjugate(before) * across * before * root.rotation);
        update();
    }

    void stretch() noexcept {
        const IkTip& tip = tips[0];
        for (const std::size_t bone : tip.chain) {
            if (!bones[bone].is_ball) return;
        }
        const Vec3<double> wanted = unit(tip.goal - bones[tip.root].head, Vec3<double>(0.0));
        for (std::size_t k = 0; k < tip.chain.size(); ++k) {
            IkBone& bone = bones[tip.chain[k]];
            if (k > 0) {
                bone.root_from_rest = bones[tip.chain[k - 1]].root_from_bone * bone.parent_from_rest;
            }
            const Vec3<double> link =
                k + 1 < tip.chain.size() ? translation(bones[tip.chain[k + 1]].parent_from_rest) : tip.offset;
            const Vec3<double> now = unit(rotate(bone.root_from_rest.real * bone.rotation, link), wanted);
            const Vec3<double> across = glm::cross(now, wanted);
            const double sine = safe_length(across);
            const double cosine = glm::dot(now, wanted);
            // Opposite directions: any perpendicular axis.
            const Vec3<double> other =
                std::abs(now.x) < 0.7 ? Vec3<double>(1.0, 0.0, 0.0) : Vec3<double>(0.0, 1.0, 0.0);
            const Vec3<double> axis =
                sine > 1e-12 ? across / sine : unit(glm::cross(now, other), Vec3<double>(0.0));
            bone.rotate_by(std::atan2(sine, cosine) * axis);
            bone.root_from_bone = bone.root_from_rest * DualQuat<double>{bone.rotation};
        }
        update();
    }

    void update_axes() noexcept {
        for (IkAxis& axis : axes) {
            const IkBone& bone = bones[axis.bone];
            const Vec3<double> direction = direction_of(bone, axis.axis, axis.speed);
            axis.screw = {direction, glm::cross(bone.head, direction)};
            axis.is_blocked = false;
        }
    }

    void update_columns() noexcept {
        for (std::size_t k = 0; k < axes.size(); ++k) {
            const IkAxis& axis = axes[k];
            double* column = &columns[k * row_count];
            std::size_t row = 0;
            const auto write = [&](const Vec3<double>& v) {
                for (int i = 0; i < 3; ++i) column[row++] = v[i];
            };
            for (const IkTip& tip : tips) {
                const bool moves = tip.is_moved_by[axis.bone];
                if (tip.effector.position_weight > 0.0) {
                    const Vec3<double> velocity =
                        axis.screw.linear + glm::cross(axis.screw.angular, tip.position);
                    write(moves ? tip.effector.position_weight * velocity : Vec3<double>(0.0));
                }
                if (tip.effector.rotation_weight > 0.0) {
                    write(moves ? tip.effector.rotation_weight * axis.screw.angular : Vec3<double>(0.0));
                }
            }
        }
    }

    void update_residual() noexcept {
        std::size_t row = 0;
        const auto write = [&](const Vec3<double>& v) {
            for (int i = 0; i < 3; ++i) residual[row++] = v[i];
        };
        for (const IkTip& tip : tips) {
            if (tip.effector.position_weight > 0.0) {
                write(tip.effector.position_weight * (tip.goal - tip.position));
            }
            if (tip.effector.rotation_weight > 0.0) write(tip.effector.rotation_weight * rotation_error(tip));
        }
    }

    void block_axes() noexcept {
        for (std::size_t k = 0; k < axes.size(); ++k) {
            axes[k].along = unit_axis(axes[k].axis);
            gradient[k] = 0.0;
            for (std::size_t row = 0; row < row_count; ++row) {
                gradient[k] += columns[k * row_count + row] * residual[row];
            }
        }
        for (std::size_t k = 0; k < axes.size(); ++k) {
            const IkBone& bone = bones[axes[k].bone];
            if (bone.is_ball) continue;
            const auto i = static_cast<int>(axes[k].axis);
            const double at = bone.coordinates[i];
            const double most = bone.high[axes[k].axis];
            const double least = bone.low[axes[k].axis];
            if ((at >= most - kAtBoundary && gradient[k] > 0.0) ||
                (at <= least + kAtBoundary && gradient[k] < 0.0)) {
                axes[k].is_blocked = true;
            }
        }
        block_at_boundaries([&](std::size_t axis) { return gradient[axis] * axes[axis].speed; });
    }

    /// Blocks swings on the boundary of their ellipse whose change, in either axis, leads out of it.
    template <class Change>
    bool block_at_boundaries(const Change& change_of) noexcept {
        bool has_blocked = false;
        for (std::size_t x = 0; x < axes.size(); ++x) {
            const IkBone& bone = bones[axes[x].bone];
            if (bone.is_ball || !bone.swings_about_two || axes[x].axis != 0) continue;
            const std::size_t z = bone.is_free[1] ? x + 2 : x + 1;
            if (axes[x].is_blocked || axes[z].is_blocked) continue;
            const Vec3<double>& c = bone.coordinates;
            const auto is_outward = [&](const Vec3<double>& out) {
                return out.x * change_of(x) + out.z * change_of(z) > 0.0;
            };
            const double half_x = c.x < 0.0 ? bone.low[0] : bone.high[0];
            const double half_z = c.z < 0.0 ? bone.low[2] : bone.high[2];
            Vec3<double> outward(c.x, 0.0, c.z);
            bool is_at_boundary = glm::dot(outward, outward) >= 1.0 - kLeastSwing * kLeastSwing - kAtBoundary;
            if (bone.has_ellipse && std::abs(half_x) > 1e-9 && std::abs(half_z) > 1e-9) {
                const Vec3<double> of_ellipse(c.x / (half_x * half_x), 0.0, c.z / (half_z * half_z));
                if (c.x * of_ellipse.x + c.z * of_ellipse.z >= 1.0 - kAtBoundary) {
                    outward = of_ellipse;
                    is_at_boundary = true;
                }
            }
            if (is_at_boundary && is_outward(outward)) {
                block_at_boundary(x, z, glm::normalize(outward));
                has_blocked = true;
            }
        }
        return has_blocked;
    }

    void block_at_boundary(std::size_t x, std::size_t z, const Vec3<double>& outward) noexcept {
        // The two axes become one, along the boundary.
        const Vec3<double> along(-outward.z, 0.0, outward.x);
        const Vec3<double> velocity =
            along.x * axes[x].speed * axes[x].screw.angular + along.z * axes[z].speed * axes[z].screw.angular;
        const double speed = glm::length(velocity);
        for (std::size_t row = 0; row < row_count; ++row) {
            double& of_x = columns[x * row_count + row];
            of_x = (along.x * axes[x].speed * of_x + along.z * axes[z].speed * columns[z * row_count + row]) /
                   speed;
        }
        axes[x].along = along;
        axes[x].speed = speed;
        axes[z].is_blocked = true;
    }

    bool find_steps(double damping) noexcept {
        const std::size_t m = row_count;
        for (std::size_t row = 0; row < m; ++row) {
            for (std::size_t column = 0; column <= row; ++column) normal[row * m + column] = 0.0;
            normal[row * m + row] = damping;
        }
        for (std::size_t k = 0; k < axes.size(); ++k) {
            if (axes[k].is_blocked) continue;
            const double weight = bones[axes[k].bone].weight[axes[k].axis];
            const double* of = &columns[k * m];
            for (std::size_t row = 0; row < m; ++row) {
                const double factor_of_row = weight * of[row];
                for (std::size_t column = 0; column <= row; ++column) {
                    normal[row * m + column] += factor_of_row * of[column];
                }
            }
        }
        // Cholesky decomposition, in place.
        for (std::size_t j = 0; j < m; ++j) {
            double* of_j = &normal[j * m];
            for (std::size_t k = 0; k < j; ++k) of_j[j] -= of_j[k] * of_j[k];
            if (!(of_j[j] > 0.0)) return false;
            of_j[j] = std::sqrt(of_j[j]);
            for (std::size_t i = j + 1; i < m; ++i) {
                double* of_i = &normal[i * m];
                for (std::size_t k = 0; k < j; ++k) of_i[j] -= of_i[k] * of_j[k];
                of_i[j] /= of_j[j];
            }
        }
        for (std::size_t i = 0; i < m; ++i) {
            double sum = residual[i];
            for (std::size_t k = 0; k < i; ++k) sum -= normal[i * m + k] * solution[k];
            solution[i] = sum / normal[i * m + i];
        }
        for (std::size_t i = m; i-- > 0;) {
            double sum = solution[i];
            for (std::size_t k = i + 1; k < m; ++k) sum -= normal[k * m + i] * solution[k];
            solution[i] = sum / normal[i * m + i];
        }
        for (std::size_t k = 0; k < axes.size(); ++k) {
            steps[k] = 0.0;
            if (axes[k].is_blocked) continue;
            for (std::size_t row = 0; row < m; ++row) steps[k] += columns[k * m + row] * solution[row];
            steps[k] *= bones[axes[k].bone].weight[axes[k].axis];
        }
        return true;
    }

    bool block_steps() noexcept {
        bool has_blocked = false;
        for (std::size_t k = 0; k < axes.size(); ++k) {
            const IkBone& bone = bones[axes[k].bone];
            if (bone.is_ball || axes[k].is_blocked) continue;
            const auto i = static_cast<int>(axes[k].axis);
            const double step = steps[k] * axes[k].along[i];
            if ((bone.coordinates[i] >= bone.high[axes[k].axis] - kAtBoundary && step > 0.0) ||
                (bone.coordinates[i] <= bone.low[axes[k].axis] + kAtBoundary && step < 0.0)) {
                axes[k].is_blocked = has_blocked = true;
            }
        }
        const auto change_of = [&](std::size_t axis) { return steps[axis] / axes[axis].speed; };
        return block_at_boundaries(change_of) || has_blocked;
    }

    void take_steps() noexcept {
        double largest = 0.0;
        for (const double step : steps) largest = std::max(largest, std::abs(step));
        const double share = largest > kLargestStep ? kLargestStep / largest : 1.0;
        std::size_t k = 0;
        while (k < axes.size()) {
            const std::size_t index = axes[k].bone;
            IkBone& bone = bones[index];
            Vec3<double> change(0.0);
            for (; k < axes.size() && axes[k].bone == index; ++k) {
                change += (share * steps[k] / axes[k].speed) * axes[k].along;
            }
            if (change == Vec3<double>(0.0)) continue;
            if (bone.is_ball) {
                bone.rotation = glm::normalize(bone.rotation * quat_from_rotation_vector(change));
            } else {
                bone.set_coordinates(bone.coordinates + change);
            }
        }
        update();
    }

    /// The unit vector about which the bone rotates as its coordinate grows, and the speed.
    static Vec3<double> direction_of(const IkBone& bone, std::size_t axis, double& speed) noexcept {
        speed = 1.0;
        // A twist is applied last, and the axes of a ball joint rotate with it, so both use the bone's own axes.
        if (bone.is_ball || axis == 1) return rotate(bone.root_from_bone.real, unit_axis(axis));
        if (!bone.swings_about_two) return rotate(bone.root_from_rest.real, unit_axis(axis));
        // The derivative of the swing with respect to x or z of its quaternion (w, x, 0, z): 2 (dq q*).
        const double x = bone.coordinates.x;
        const double z = bone.coordinates.z;
        const double w = std::sqrt(1.0 - x * x - z * z);
        const Vec3<double> velocity = 2.0 * (axis == 0 ? Vec3<double>(w + x * x / w, z, x * z / w)
                                                       : Vec3<double>(x * z / w, -x, w + z * z / w));
        speed = glm::length(velocity);
        return rotate(bone.root_from_rest.real, velocity / speed);
    }
};

IkSolver::IkSolver(const Skeleton& skeleton, std::span<const BoneLimits> limits,
                   std::span<const IkEffector> effectors)
    : state_(make_owned<State>(skeleton, limits, effectors)) {}

std::size_t IkSolver::bone_count() const noexcept { return state_->bones.size(); }
std::size_t IkSolver::effector_count() const noexcept { return state_->tips.size(); }

std::optional<IkResult> IkSolver::solve(const IkProblem& problem, std::span<Quat<double>> rotations,
                                        const IkOptions& options) const noexcept {
    State& state = *state_;
    if (problem.parent_from_rest.size() != bone_count() || problem.tips.size() != effector_count() ||
        problem.goals.size() != effector_count() || (state.has_pole && problem.poles.empty()) ||
        rotations.size() != bone_count()) {
        return std::nullopt;
    }
    const std::scoped_lock lock(state.mutex);
    state.start(problem, rotations);
    IkResult result;
    result.iterations = state.run(options);
    if (!state.is_reached(options.tolerance) && state.can_rotate_to_goal()) {
        const double error = state.cost();
        state.keep(state.first);
        state.start(problem, rotations);
        state.rotate_to_goal();
        result.iterations += state.run(options);
        if (!(state.cost() < error)) state.restore(state.first);
    }
    for (std::size_t i = 0; i < rotations.size(); ++i) {
        const Quat<double>& q = state.bones[i].rotation;
        rotations[i] = q.w < 0.0 ? -q : q;
    }
    // Relative to the caller's goals, since start() may have moved the solver's.
    const DualQuat<double> root_from_space = inverse(problem.space_from_root);
    for (std::size_t i = 0; i < state.tips.size(); ++i) {
        const IkTip& tip = state.tips[i];
        if (tip.effector.position_weight > 0.0) {
            const Vec3<double> goal = translation(root_from_space * problem.goals[i]);
            result.distance = std::max(result.distance, safe_length(goal - state.length * tip.position));
        }
        if (tip.effector.rotation_weight > 0.0) {
            result.angle = std::max(result.angle, safe_length(State::rotation_error(tip)));
        }
    }
    result.is_reached =
        result.distance <= options.tolerance * state.length && result.angle <= options.tolerance;
    return result;
}

}  // namespace sinew
