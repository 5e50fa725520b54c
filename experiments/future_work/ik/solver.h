// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "future_work/ik/rotation_limits.h"
#include "future_work/ik/skeleton.h"
#include "sinew/base/owned.h"
#include "sinew/transform/dual_quat.h"

namespace sinew {

/// The goal for the tip of one bone.
///
/// bone             the bone of the tip; it and all of its ancestors rotate
/// position_weight  0: the position does not count
/// rotation_weight  0: the rotation of the bone does not count. An error of 1 radian counts like one of the
///                  chain's length
/// has_pole         whether to first rotate the chain about its root, as Blender's constraint does, so that its
///                  tip points at the goal and the axis cos(pole_angle) x + sin(pole_angle) z of the root bone
///                  points to the side of the pole. Bends then stay in that plane
struct IkEffector {
    std::int32_t bone = 0;
    double position_weight = 1.0;
    double rotation_weight = 0.0;
    bool has_pole = false;
    double pole_angle = 0.0;
};

/// tolerance   errors that count as reached, in lengths of the chain and in radians
/// iterations  maximum number of steps of all axes
struct IkOptions {
    double tolerance = 1e-6;
    int iterations = 100;
};

/// The pose of the bones and the goals, in one unit of length and one space.
///
/// space_from_root   applied after the transform of every bone without a parent
/// parent_from_rest  [bones] each bone relative to its parent, not rotated: unit
/// tips              [effectors] each in the space of its bone
/// goals             [effectors] unit: the goal of the tip, and of the bone's rotation
/// poles             [effectors] points; empty if no effector has one
struct IkProblem {
    DualQuat<double> space_from_root;
    std::span<const DualQuat<double>> parent_from_rest;
    std::span<const Vec3<double>> tips;
    std::span<const DualQuat<double>> goals;
    std::span<const Vec3<double>> poles;
};

/// distance    the largest distance of a tip from its goal, of those that count
/// angle       the largest angle of a rotation to its goal, of those that count, in radians
/// iterations  how many were used
/// is_reached  whether both are within the tolerance
struct IkResult {
    double distance = 0.0;
    double angle = 0.0;
    int iterations = 0;
    bool is_reached = false;
};

/// Finds rotations of bones, within their limits, that bring tips of a tree of bones to their goals, by damped least
/// squares: each free axis is a unit screw; steps solve (J J^T + l 1) y = e, with l following the error (Wampler 1986;
/// Sugihara 2011).
///
/// Each solve starts from the given rotations and depends on nothing else, so the same input gives the same bits.
/// The signs of quaternions do not matter. A rigid motion of root, goals and poles does not change the result.
/// Computed in double, with lengths divided by that of the longest chain.
///
/// Input without a solution, or with several:
/// - If a chain with one effector whose rotation does not count can not reach its goal, the goal is first moved
///   to the nearest point of its range. Chains without limits stretch straight towards it. Other chains, and
///   trees, end near the smallest sum of squared errors.
/// - A goal at the root that the bones can reach is like any other. A goal nearer to the root than the bones can
///   fold is moved outwards to the nearest reachable distance or, if it is exactly at the root, towards the tip's
///   current direction.
/// - If a straight chain points at a nearer goal, no direction to bend is given: it is bent a little about the
///   first free axis, to the side where the limits leave more room, or to the side of the pole.
/// - A bone of length 0 moves nothing by its own rotation. A chain of length 0 only reaches its root.
/// - A pole on the line from the root to the goal is ignored, as are, as in Blender, all poles if there are
///   several effectors. Limits have priority over a pole.
/// - Limits can cause local minima, such as a chain that folds onto itself. A chain with one effector is solved a
///   second time, first rotated about its root towards its goal, and the better result is used: it is within
///   limits, and no step improves it, but a better one may exist. Bones with limits swing by at most 177.7
///   degrees.
class IkSolver {
public:
    /// limits     [bones]; empty: none
    /// effectors  at least one
    ///
    /// Throws also for an effector whose bone does not exist, negative weights, limits that are not -pi <= min <= 0 <=
    /// max <= pi, and stiffness outside of 0 to below 1.
    IkSolver(const Skeleton& skeleton, std::span<const BoneLimits> limits,
             std::span<const IkEffector> effectors);

    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] std::size_t effector_count() const noexcept;

    /// rotations  [bones] each bone's rotation relative to its rest, unit: the start, then the solution with w >=
    ///            0. Start rotations beyond the limits are brought within
    ///
    /// Returns nullopt, and writes nothing, if a size is wrong.
    [[nodiscard]] std::optional<IkResult> solve(const IkProblem& problem, std::span<Quat<double>> rotations,
                                                const IkOptions& options = {}) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
