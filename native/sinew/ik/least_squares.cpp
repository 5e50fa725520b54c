// SPDX-License-Identifier: GPL-3.0-or-later
//
// Damped least squares on screws. Each free axis of a bone is a unit screw, a line in the space of the root; a
// small rotation about it moves a tip with the screw's velocity at that point, which is its column of the
// Jacobian J. A step is W J^T (J W J^T + l 1)^-1 e, a system with as many equations as there are errors e, not
// axes; W contains the stiffness. l follows the error (Sugihara 2011), so steps near a goal are Newton steps, and
// steps towards unreachable goals do not oscillate. A step that increases the error is undone (Levenberg 1944,
// Marquardt 1963). Axes at a limit that a step would exceed are left out of that step.
#include <algorithm>

#include "sinew/ik/state.h"

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

}  // namespace

Vec3<double> IkSolver::State::direction_of(const IkBone& bone, std::size_t axis, double& speed) noexcept {
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

void IkSolver::State::update_axes() noexcept {
    for (IkAxis& axis : axes) {
        const IkBone& bone = bones[axis.bone];
        const Vec3<double> direction = direction_of(bone, axis.axis, axis.speed);
        axis.screw = {direction, glm::cross(bone.head, direction)};
        axis.is_blocked = false;
    }
}

void IkSolver::State::update_columns() noexcept {
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

void IkSolver::State::update_residual() noexcept {
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

void IkSolver::State::block_at_boundary(std::size_t x, std::size_t z, const Vec3<double>& outward) noexcept {
    // The two axes become one, along the boundary.
    const Vec3<double> along(-outward.z, 0.0, outward.x);
    const Vec3<double> velocity =
        along.x * axes[x].speed * axes[x].screw.angular + along.z * axes[z].speed * axes[z].screw.angular;
    const double speed = glm::length(velocity);
    for (std::size_t row = 0; row < row_count; ++row) {
        double& of_x = columns[x * row_count + row];
        of_x =
            (along.x * axes[x].speed * of_x + along.z * axes[z].speed * columns[z * row_count + row]) / speed;
    }
    axes[x].along = along;
    axes[x].speed = speed;
    axes[z].is_blocked = true;
}

void IkSolver::State::block_axes() noexcept {
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

template <class Change>
bool IkSolver::State::block_at_boundaries(const Change& change_of) noexcept {
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

bool IkSolver::State::find_steps(double damping) noexcept {
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

bool IkSolver::State::block_steps() noexcept {
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

void IkSolver::State::take_steps() noexcept {
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

void IkSolver::State::bend() noexcept {
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

int IkSolver::State::run(const IkOptions& options) noexcept {
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

}  // namespace sinew
