// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include "sinew/lanes/kernel.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace sinew {

/// A line, and two axes of length 1 that are perpendicular to it and to each other.
struct TwistLine {
    float origin[3];
    float axes[2][3];
};

/// A bone at rest, whose vertices may be twisted.
struct TwistRest {
    TwistLine line;
    float share[4];  // of a rest point (x, y, z, 1): 0 at the head, 1 at the tail
};

/// A bone of TwistRest in one frame.
struct TwistedBone {
    bool is_twisted = false;  // if not, nothing else is set
    bool is_scaled;
    bool has_axis;       // the posed axis has a direction
    bool is_short;       // no vertex goes beyond half a turn
    float images[2][3];  // of the axes at rest, by the linear part of the bone's motion
    TwistLine posed;
    float displacement[12];  // the bone's motion, as in write_displacement()
    float curve;
    float angle;   // half of it, radians
    float offset;  // radians, added to the angle times the share
    float around;  // as in TwistSpreadStage::Bone
    float part;    // as in TwistSpreadStage::Bone
};

/// What a twist has to do with the vertices of a block.
struct BlockTwist {
    Lanes<float> share{};     // 0 at the bone's head, 1 at its tail
    Lanes<float> arms[2]{};   // the vertex's distances from the line along the axes, times `weight`
    Lanes<float> weight{};    // of the bone
    Lanes<float> below{};     // argument of TwistSpreadStage::missing_turns()
    std::size_t twist;        // into TwistFrame::bones
    bool has_weight = false;  // else bones beyond the twist share vertices with others
};

/// A block, and its twists: those that other bones carry first.
struct TwistBlock {
    std::size_t block;
    std::size_t begin;  // into TwistFrame::block_twists
    std::size_t end;
};

/// The arguments of one call of the kernel.
struct TwistFrame {
    const PackedMesh* mesh;
    const Lanes<float>* rest_points;
    const TwistBlock* blocks;
    BlockTwist* block_twists;     // output of measure
    const TwistRest* rest;        // [twists] of measure
    const TwistedBone* bones;     // [twists]
    const Lanes<float>* weights;  // [PackedMesh::blocks]; null if all are 1
    const Lanes<float>* mix;      // [PackedMesh::blocks]; null if all are 0
    TwistBlend blend = TwistBlend::linear;
    TwistBlend mix_blend = TwistBlend::linear;  // equals `blend` without a mix, and where it would not matter
    bool is_linear = true;                      // all blends are
    bool goes_around = false;  // a bone is farther than the shorter way, and a method blends the shorter way
    Spaces spaces;
    Vec3<float>* points;
};

/// Functions for `blocks` [begin, end), compiled once for each instruction set.
struct TwistKernel {
    OfTargets<void(const TwistFrame& frame, std::size_t begin, std::size_t end)> spread;
    /// Writes BlockTwist::share and arms for the rest points.
    decltype(spread) measure;
};
extern const TwistKernel kTwistKernel;

[[nodiscard]] TwistLine twist_line(const Vec3<double>& origin, const Vec3<double>& axis) noexcept;

}  // namespace sinew
