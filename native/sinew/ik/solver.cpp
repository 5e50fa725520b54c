// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/ik/solver.h"

#include <limits>
#include <mutex>
#include <string>

#include "sinew/base/fail.h"
#include "sinew/ik/state.h"

namespace sinew {
namespace {

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

double wrapped(double angle) noexcept { return std::remainder(angle, 2.0 * std::numbers::pi); }

}  // namespace

void IkBone::set_coordinates(const Vec3<double>& values) noexcept {
    Vec3<double> c = values;
    for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(i);
        c[i] = is_free[axis] ? std::clamp(c[i], low[axis], high[axis]) : 0.0;
    }
    Quat<double> swing(1.0, 0.0, 0.0, 0.0);
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
        swing = Quat<double>(std::sqrt(1.0 - c.x * c.x - c.z * c.z), c.x, 0.0, c.z);
    } else {
        // At most one of the two is not 0.
        const double half = 0.5 * (c.x + c.z);
        swing = Quat<double>(std::cos(half), is_free[0] ? std::sin(half) : 0.0, 0.0,
                             is_free[2] ? std::sin(half) : 0.0);
    }
    coordinates = c;
    rotation = swing * Quat<double>(std::cos(0.5 * c.y), 0.0, std::sin(0.5 * c.y), 0.0);
}

void IkBone::set_rotation(const Quat<double>& either) noexcept {
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

void IkBone::rotate_by(const Vec3<double>& axis) noexcept {
    const Quat<double>& before = root_from_rest.real;
    const Quat<double> own = glm::conjugate(before) * quat_from_rotation_vector(axis) * before;
    set_rotation(own * rotation);
}

IkSolver::State::State(const Skeleton& skeleton, std::span<const BoneLimits> limits,
                       std::span<const IkEffector> effectors) {
    const std::size_t bone_count = skeleton.bone_count();
    if (!limits.empty() && limits.size() != bone_count) {
        fail("limits", "those of " + std::to_string(bone_count) + " bones", std::to_string(limits.size()));
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
        for (std::int32_t at = effectors[i].bone; at >= 0; at = bones[static_cast<std::size_t>(at)].parent) {
            tip.root = static_cast<std::size_t>(at);
            tip.chain.insert(tip.chain.begin(), tip.root);
            tip.is_moved_by[tip.root] = true;
            bones[tip.root].moves = true;
        }
        row_count +=
            (tip.effector.position_weight > 0.0 ? 3u : 0u) + (tip.effector.rotation_weight > 0.0 ? 3u : 0u);
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

void IkSolver::State::start(const IkProblem& problem, std::span<const Quat<double>> rotations) noexcept {
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

bool IkSolver::State::move_goal_within_reach() noexcept {
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

void IkSolver::State::stretch() noexcept {
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

bool IkSolver::State::can_rotate_to_goal() const noexcept {
    return tips.size() == 1 && !has_pole && tips[0].effector.position_weight > 0.0 &&
           tips[0].chain.size() > 1;
}

void IkSolver::State::rotate_to_goal() noexcept {
    const IkTip& tip = tips[0];
    IkBone& root = bones[tip.root];
    const Vec3<double> now = tip.position - root.head;
    const Vec3<double> wanted = tip.goal - root.head;
    const Vec3<double> axis = unit(glm::cross(now, wanted), Vec3<double>(0.0));
    root.rotate_by(std::atan2(safe_length(glm::cross(now, wanted)), glm::dot(now, wanted)) * axis);
    update();
}

void IkSolver::State::rotate_to_pole() noexcept {
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

void IkSolver::State::update() noexcept {
    for (IkBone& bone : bones) {
        if (!bone.moves) continue;
        bone.root_from_rest = bone.parent < 0 ? bone.parent_from_rest
                                              : bones[static_cast<std::size_t>(bone.parent)].root_from_bone *
                                                    bone.parent_from_rest;
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

double IkSolver::State::cost() const noexcept {
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

bool IkSolver::State::is_reached(double tolerance) const noexcept {
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

void IkSolver::State::keep(Pose& pose) const noexcept {
    for (std::size_t i = 0; i < bones.size(); ++i) {
        pose.rotations[i] = bones[i].rotation;
        pose.coordinates[i] = bones[i].coordinates;
    }
}

void IkSolver::State::restore(const Pose& pose) noexcept {
    for (std::size_t i = 0; i < bones.size(); ++i) {
        bones[i].rotation = pose.rotations[i];
        bones[i].coordinates = pose.coordinates[i];
    }
    update();
}

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
