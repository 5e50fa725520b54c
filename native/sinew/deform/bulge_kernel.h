// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "sinew/deform/kernels.h"
#include "sinew/skinning/bulge_limit.h"

namespace sinew {

/// A bone's segment as the kernel reads it: the head and how much it stretches, the vector to the tail, and what makes
/// of a point (x, y, z, 1) where it is between them, as a part of that vector.
struct BulgeBone {
    Float4 head;
    Float4 along;
    Float4 share;
};

/// What the kernels of one call read and write.
struct BulgeFrame {
    const PackedMesh* mesh;
    const BulgeBone* bones;       // of PackedMesh::used_bones
    Lanes<float>* distances[2];   // of each form: [blocks] at rest, with the allowance
    const Lanes<float>* weights;  // [blocks]; null: all 1
    BulgeForm form;
    float strength;
    bool is_stretched;               // a bone stretches
    const Float4* bones_from_model;  // displacements, as in Frame
    const Float4* model_from_bones;
    Vec3<float>* points;
};

/// Functions of blocks [begin, end), compiled once for each instruction set.
struct BulgeKernel {
    void (*limit)(const BulgeFrame& frame, std::size_t begin, std::size_t end);
    /// Writes the distances of the points, which are those at rest.
    void (*measure)(const BulgeFrame& frame, std::size_t begin, std::size_t end);
};

/// For the instruction set in use.
[[nodiscard]] BulgeKernel bulge_kernel() noexcept;

[[nodiscard]] BulgeBone bulge_bone(const BoneSegment<double>& segment, double stretch) noexcept;

}  // namespace sinew
