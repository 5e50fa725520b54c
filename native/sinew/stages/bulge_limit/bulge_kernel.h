// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "sinew/lanes/kernel.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"

namespace sinew {

/// A bone's segment in the form that the kernel reads: the head and the stretch; the vector from head to tail;
/// and the coefficients that map a point (x, y, z, 1) to its position along that vector, 0 at the head and 1 at
/// the tail.
struct BulgeBone {
    Float4 head;
    Float4 along;
    Float4 share;
};

/// The arguments of one call of the kernels.
struct BulgeFrame {
    const PackedMesh* mesh;
    const BulgeBone* bones;       // for each of PackedMesh::used_bones
    Lanes<float>* distances[2];   // for each form: [blocks] at rest, with the allowance
    const Lanes<float>* weights;  // [blocks]; null if all are 1
    BulgeForm form;
    float strength;
    bool is_stretched;  // some bone has a stretch other than 1
    Spaces spaces;
    Vec3<float>* points;
};

/// Functions for blocks [begin, end), compiled once for each instruction set.
struct BulgeKernel {
    OfTargets<void(const BulgeFrame& frame, std::size_t begin, std::size_t end)> limit;
    /// Writes the distances of the points, which must be at rest.
    decltype(limit) measure;
};
extern const BulgeKernel kBulgeKernel;

[[nodiscard]] BulgeBone bulge_bone(const BoneSegment<double>& segment, double stretch) noexcept;

}  // namespace sinew
