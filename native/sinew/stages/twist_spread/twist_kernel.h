// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include "sinew/lanes/kernel.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace sinew {

/// A rotation about a line by any angle: what sine and 1 - cosine add to a point, by rows of three numbers.
struct Spin {
    float origin[3];
    float sine[9];
    float versine[9];
};

/// A bone whose vertices are twisted in this frame.
struct TwistedBone {
    Spin rest;               // about the axis at rest, followed by the linear part of the bone's motion
    Spin posed;              // about the posed axis
    float displacement[12];  // the bone's motion, as in write_displacement()
    float share[4];          // of a rest point (x, y, z, 1): 0 at the head, 1 at the tail
    float curve;
    float angle;   // turns
    float offset;  // turns, added to the angle times the share
    float around;  // as in TwistSpreadStage::Bone
    float part;    // the same
    bool is_scaled;
    bool has_axis;              // the posed axis has a direction
    const std::uint8_t* below;  // for each of PackedMesh::used_bones, whether it is beyond the twist
};

/// The arguments of one call of the kernel.
struct TwistFrame {
    const PackedMesh* mesh;
    const Lanes<float>* rest_points;
    const TwistedBone* twisted;  // those that other bones carry first
    std::size_t twisted_count;
    const std::int32_t* twisted_of_bone;  // for each of PackedMesh::used_bones, -1 for none
    const Lanes<float>* weights;          // [blocks]; null if all are 1
    const Lanes<float>* mix;              // [blocks]; null if all are 0
    TwistBlend blend;
    TwistBlend mix_blend;
    bool goes_around;  // a bone is farther than the shorter way, and a method blends the shorter way
    Spaces spaces;
    Vec3<float>* points;
};

/// Twists the points of blocks [begin, end), by the kernel for the instruction set in use.
void spread_twists(const TwistFrame& frame, std::size_t begin, std::size_t end) noexcept;

/// The rotation about an axis of length 1, followed by a linear map.
[[nodiscard]] Spin spin(const Vec3<double>& origin, const Vec3<double>& axis,
                        const Mat3<double>& then) noexcept;

}  // namespace sinew
