// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "sinew/base/fork_safe.h"
#include "sinew/ik/solver.h"
#include "sinew/transform/twist.h"

namespace sinew {

/// The smallest cosine of half a swing about two axes, unless both are free and without limits: 177.7 degrees. At
/// 180 degrees the two coordinates are singular.
inline constexpr double kLeastSwing = 0.02;

/// How often a solve bends a chain that points straight at its goal.
inline constexpr int kMaxBends = 3;

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

    Quat<double> rotation{1.0, 0.0, 0.0, 0.0};
    Vec3<double> coordinates{0.0};
    DualQuat<double> parent_from_rest;

    /// Before and after the bone's own rotation; in the space of the root, lengths divided by that of the longest
    /// chain.
    DualQuat<double> root_from_rest;
    DualQuat<double> root_from_bone;
    Vec3<double> head{0.0};

    void set_rotation(const Quat<double>& q) noexcept;
    void set_coordinates(const Vec3<double>& values) noexcept;
    /// Rotates the bone further by `axis`, a rotation vector in the space of the root, as far as its limits
    /// allow.
    void rotate_by(const Vec3<double>& axis) noexcept;
};

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
    Quat<double> rotation{1.0, 0.0, 0.0, 0.0};
    Vec3<double> goal{0.0};
    Quat<double> goal_rotation{1.0, 0.0, 0.0, 0.0};
};

struct IkSolver::State {
    State(const Skeleton& skeleton, std::span<const BoneLimits> limits,
          std::span<const IkEffector> effectors);

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

    void start(const IkProblem& problem, std::span<const Quat<double>> rotations) noexcept;
    /// Updates the poses of all bones that move, and the tips.
    void update() noexcept;
    /// The rotation vector from the tip's rotation to its goal's.
    [[nodiscard]] static Vec3<double> rotation_error(const IkTip& tip) noexcept {
        return rotation_vector(tip.goal_rotation * glm::conjugate(tip.rotation));
    }
    /// Half the sum of squared errors.
    [[nodiscard]] double cost() const noexcept;
    [[nodiscard]] bool is_reached(double tolerance) const noexcept;
    void keep(Pose& pose) const noexcept;
    void restore(const Pose& pose) noexcept;

    /// Returns the number of iterations.
    int run(const IkOptions& options) noexcept;
    /// For a second try, if a chain has folded onto itself on the way to a goal behind it.
    [[nodiscard]] bool can_rotate_to_goal() const noexcept;
    void rotate_to_goal() noexcept;
    /// Bends straight chains a little, if no axis moves a tip nearer to its goal.
    void bend() noexcept;

private:
    bool move_goal_within_reach() noexcept;
    void rotate_to_pole() noexcept;
    void stretch() noexcept;

    void update_axes() noexcept;
    void update_columns() noexcept;
    void update_residual() noexcept;
    void block_axes() noexcept;
    /// Blocks swings on the boundary of their ellipse whose change, in either axis, leads out of it.
    template <class Change>
    bool block_at_boundaries(const Change& change_of) noexcept;
    void block_at_boundary(std::size_t x, std::size_t z, const Vec3<double>& outward) noexcept;
    bool find_steps(double damping) noexcept;
    bool block_steps() noexcept;
    void take_steps() noexcept;

    /// The unit vector about which the bone rotates as its coordinate grows, and the speed.
    static Vec3<double> direction_of(const IkBone& bone, std::size_t axis, double& speed) noexcept;
};

}  // namespace sinew
