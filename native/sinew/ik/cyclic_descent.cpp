// SPDX-License-Identifier: GPL-3.0-or-later
//
// Cyclic descent. FABRIK (Aristidou, Lasenby 2011) is as simple, but here each step is a rotation about a bone's
// own head, so limits, locked axes, goals for rotations and branches are part of every step, and lengths are
// preserved. FABRIK moves points; rotations have to be found for them afterwards, and limits repaired in each
// pass.
//
// For pairs (a, b) of directions from a bone's head to its tips and to their goals, the best rotation about an axis n
// has the angle atan2(n . sum a x b, sum (a . b - (n . a) (n . b))). Of all axes, the direction of the sum of the
// moments a x b reduces the error fastest; for one tip it gives exactly the rotation to its goal. A bone's rotation
// affects only its descendants, so from the tips to the root the dual quaternions of bones are evaluated once in each
// sweep.
#include <glm/gtc/matrix_access.hpp>

#include "sinew/ik/state.h"

namespace sinew {
namespace {

// The last sweep is the first one that lowers the cost by less than this, relative to the cost.
constexpr double kStagnation = 1e-6;

/// Sums a b^T over pairs of vectors seen from a bone's head: a is moved by the bone, b is where it should be.
struct Pulls {
    Mat3<double> products{0.0};

    void add(double weight, const Vec3<double>& a, const Vec3<double>& b) noexcept {
        products += glm::outerProduct(weight * a, b);
    }
    [[nodiscard]] Vec3<double> moment() const noexcept {
        return {products[2][1] - products[1][2], products[0][2] - products[2][0],
                products[1][0] - products[0][1]};
    }
    [[nodiscard]] double best_angle(const Vec3<double>& axis) const noexcept {
        const double trace = products[0][0] + products[1][1] + products[2][2];
        return std::atan2(glm::dot(axis, moment()), trace - glm::dot(axis, products * axis));
    }
    /// How much nearer the rotation `q` of all a brings them: the sum of the changes of b . a.
    [[nodiscard]] double gain(const Quat<double>& q) const noexcept {
        const Mat3<double> change = to_mat3(q) - Mat3<double>(1.0);
        double sum = 0.0;
        for (int i = 0; i < 3; ++i) sum += glm::dot(glm::row(change, i), glm::column(products, i));
        return sum;
    }
};

}  // namespace

Quat<double> IkSolver::State::rotation_since(const IkBone& bone, const Quat<double>& rotation) noexcept {
    const Quat<double>& before = bone.root_from_rest.real;
    return before * bone.rotation * glm::conjugate(before * rotation);
}

void IkSolver::State::descend(std::size_t index) noexcept {
    IkBone& bone = bones[index];
    Pulls pulls;
    for (const IkTip& tip : tips) {
        if (!tip.is_moved_by[index]) continue;
        const double position = tip.effector.position_weight;
        const double rotation = tip.effector.rotation_weight;
        if (position > 0.0) pulls.add(position * position, tip.position - bone.head, tip.goal - bone.head);
        if (!(rotation > 0.0)) continue;
        const Mat3<double> now = to_mat3(tip.rotation);
        const Mat3<double> wanted = to_mat3(tip.goal_rotation);
        // Halved: three directions together count twice the squared angle.
        for (int i = 0; i < 3; ++i) pulls.add(0.5 * rotation * rotation, now[i], wanted[i]);
    }
    const Quat<double> at_first = bone.rotation;
    if (bone.is_ball || bone.swings_about_two) {
        const Vec3<double> coordinates = bone.coordinates;
        const Vec3<double> axis = unit(pulls.moment(), Vec3<double>(0.0));
        const Quat<double> to_root = bone.root_from_rest.real * bone.rotation;
        Vec3<double> own = rotate(glm::conjugate(to_root), pulls.best_angle(axis) * axis);
        for (int i = 0; i < 3; ++i) own[i] *= bone.weight[static_cast<std::size_t>(i)];
        bone.rotate_by(rotate(to_root, own));
        const Quat<double> change = rotation_since(bone, at_first);
        // Limiting the rotation may lose more than was gained.
        if (!bone.is_ball && !(pulls.gain(change) > 0.0)) {
            bone.rotation = at_first;
            bone.coordinates = coordinates;
        } else {
            pulls.products = to_mat3(change) * pulls.products;
        }
    }
    for (std::size_t i = 0; i < 3 && !bone.is_ball; ++i) {
        if (!bone.is_free[i]) continue;
        const Vec3<double> coordinates = bone.coordinates;
        const Quat<double> before = bone.rotation;
        bone.root_from_bone.real = bone.root_from_rest.real * before;
        double speed = 1.0;
        const Vec3<double> axis = direction_of(bone, i, speed);
        Vec3<double> moved = coordinates;
        moved[static_cast<int>(i)] += bone.weight[i] * pulls.best_angle(axis) / speed;
        bone.set_coordinates(moved);
        const Quat<double> change = rotation_since(bone, before);
        if (pulls.gain(change) > 0.0) {
            pulls.products = to_mat3(change) * pulls.products;
        } else {
            bone.rotation = before;
            bone.coordinates = coordinates;
        }
    }
    const Quat<double> change = rotation_since(bone, at_first);
    for (IkTip& tip : tips) {
        if (!tip.is_moved_by[index]) continue;
        tip.position = bone.head + rotate(change, tip.position - bone.head);
        tip.rotation = change * tip.rotation;
    }
}

int IkSolver::State::solve_by_descent(const IkOptions& options) noexcept {
    double error = cost();
    int bends = 0;
    int iteration = 0;
    keep(best);
    double least = error;
    while (iteration < options.iterations && !is_reached(options.tolerance)) {
        ++iteration;
        for (std::size_t bone = bones.size(); bone-- > 0;) {
            if (bones[bone].moves) descend(bone);
        }
        update();
        const double found = cost();
        if (found < least) {
            least = found;
            keep(best);
        }
        if (!(error - found > kStagnation * found)) {
            if (bends == kMaxBends || is_reached(options.tolerance)) break;
            ++bends;
            update_axes();
            bend();
            error = cost();
            continue;
        }
        error = found;
    }
    if (least < cost()) restore(best);
    return iteration;
}

}  // namespace sinew
