// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "sinew/export.h"
#include "sinew/ik/rotation_limits.h"
#include "sinew/skeleton/skeleton.h"
#include "sinew/transform/dual_quat.h"

namespace sinew {

/// What of a tree of bones is to be where: the tip of one of them.
///
/// bone             that the tip belongs to; it and all bones above it rotate
/// position_weight  0: the position does not count
/// rotation_weight  0: the rotation of the bone does not count. An error of 1 radian counts as one of the chain's length
/// has_pole         whether the chain is first rotated about its root, as by Blender's constraint, until its tip lies to
///                  its goal and the axis cos(pole_angle) x + sin(pole_angle) z of the root bone to the side of the pole:
///                  what then bends stays in that plane
struct IkEffector {
    std::int32_t bone = 0;
    double position_weight = 1.0;
    double rotation_weight = 0.0;
    bool has_pole = false;
    double pole_angle = 0.0;
};

/// How the rotations are found.
///
///   damped_least_squares  each free axis is a unit screw; steps solve (J J^T + l 1) y = e, l following the error
///                         (Wampler 1986; Sugihara 2011)
///   cyclic_descent        each bone in turn, from the tip, rotates to where its tips are nearest to their goals (Wang,
///                         Chen 1991): cheap steps, and many of them where a chain is nearly straight
enum class IkMethod : std::uint8_t { damped_least_squares, cyclic_descent };

/// By their names, in the order of IkMethod.
inline constexpr std::array<std::string_view, 2> kIkMethods{"dls", "ccd"};

/// tolerance   in lengths of the chain, and in radians: what counts as reached
/// iterations  at most: steps of all axes, or sweeps over all bones
struct IkOptions {
    IkMethod method = IkMethod::damped_least_squares;
    double tolerance = 1e-6;
    int iterations = 100;
};

/// A pose of the bones and what is wanted of it, in one unit of length and one space.
///
/// space_from_root   placed before every bone without a parent
/// parent_from_rest  [bones] each bone relative to its parent, not rotated: unit
/// tips              [effectors] in the space of each one's bone
/// goals             [effectors] unit: where the tip is to be, and how the bone is to be rotated
/// poles             [effectors] points; empty where no effector has one
struct IkProblem {
    DualQuat<double> space_from_root;
    std::span<const DualQuat<double>> parent_from_rest;
    std::span<const Vec3<double>> tips;
    std::span<const DualQuat<double>> goals;
    std::span<const Vec3<double>> poles;
};

/// distance    the largest distance of a tip that counts from its goal
/// angle       the largest angle of a rotation that counts to its goal, radians
/// iterations  how many it took
/// is_reached  whether both are within the tolerance
struct IkResult {
    double distance = 0.0;
    double angle = 0.0;
    int iterations = 0;
    bool is_reached = false;
};

/// Finds rotations of bones, within their limits, that bring tips of a tree of bones to their goals.
///
/// Each solve starts from the rotations that it is given and depends on nothing else, so the same input gives the same
/// bits. The signs of quaternions do not matter; a rigid motion of root, goals and poles changes nothing. Computed in
/// double, lengths divided by that of the longest chain. Nothing is allocated after construction. One solver is used by
/// one thread at a time.
///
/// What has no solution:
/// - A goal out of reach of a chain with one effector whose rotation does not count is moved to the nearest end of the
///   reach first. Chains without limits stretch straight to it. Others, and trees, end near the least sum of squares.
/// - A goal at the root that the bones can reach is as any other; one nearer than they can fold is brought nearer to
///   the same side, or, at the root itself, left at the tip's own.
/// - A chain that is straight to a nearer goal has no direction to bend to: it is bent a little about the first axis
///   that is free, to the side where the limits leave more, or to the side of the pole.
/// - A bone of length 0 moves nothing by its own rotation. A chain of length 0 reaches its root alone.
/// - A pole on the line from the root to the goal does not count, nor, as in Blender, any with several effectors. Limits
///   are kept where a pole wants otherwise.
/// - Limits can leave local minima, such as a chain that folds onto itself. A chain of one effector is tried once more,
///   rotated about its root to its goal first; then the better one stays: within limits, and no step improves it, but
///   others may be nearer. Of bones with limits a swing ends at 177.7 degrees.
class SINEW_EXPORT IkSolver {
public:
    /// limits     [bones], or empty: none
    /// effectors  at least one
    ///
    /// Throws std::invalid_argument for an effector's bone that is none, weights below 0 or not finite, limits
    /// that are not -pi <= min <= 0 <= max <= pi, and stiffness that is not 0 to below 1.
    IkSolver(const Skeleton& skeleton, std::span<const BoneLimits> limits,
             std::span<const IkEffector> effectors);
    ~IkSolver();
    IkSolver(IkSolver&& other) noexcept;
    IkSolver& operator=(IkSolver&& other) noexcept;

    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] std::size_t effector_count() const noexcept;

    /// rotations  [bones] each bone's rotation relative to its rest, unit: where to start, and then the solution, with
    ///            w >= 0. What of the start is beyond limits is brought within.
    IkResult solve(const IkProblem& problem, std::span<Quat<double>> rotations,
                   const IkOptions& options = {}) noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace sinew
