// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sinew/base/targets.h"
#include "sinew/mesh/packed_mesh.h"
#include "sinew/pose/palette.h"

namespace sinew {

/// What a method keeps of a mesh's vertices, in the order of the packed mesh. Only the method knows its form.
struct PackedVertexData {
    virtual ~PackedVertexData() = default;
    /// The data that it was packed from.
    [[nodiscard]] virtual std::vector<float> unpack(const PackedMesh& mesh, std::size_t vertices) const = 0;

    std::vector<Lanes<float>> rows;  // what a kernel reads for each block, if that is rows alone
};

/// The usual form: [blocks][kCount] rows, one for each number of a vertex.
template <std::size_t kCount>
struct VertexNumbers final : PackedVertexData {
    [[nodiscard]] std::vector<float> unpack(const PackedMesh& mesh, std::size_t vertices) const override {
        return unpack_values(mesh, rows, vertices, kCount);
    }

    /// values  [vertices][kCount]
    static std::unique_ptr<const PackedVertexData> pack(const PackedMesh& mesh,
                                                        std::span<const float> values) {
        auto packed = std::make_unique<VertexNumbers>();
        packed->rows = pack_values(mesh, values, kCount);
        return packed;
    }
};

/// The input and output of one frame, common to all blocks.
struct Frame {
    const PackedMesh* mesh;
    const Lanes<float>* rest_points;      // mesh->rest_points, or others
    const PackedVertexData* vertex_data;  // as the kernel packed it; null if there is none
    const std::int32_t* bones;            // PackedMesh::bones, or BoneSets::entries
    const Palette* palette;
    Spaces spaces;
    const double* parameters;  // [MethodInfo::parameters] valid_value() of each
    Vec3<float>* points;
};

/// How the library deforms whole meshes with one method. SINEW_KERNEL (lanes/lanes-inl.h) makes it of a struct in
/// methods/NAME/NAME.cpp.
struct Kernel {
    using Deform = void(const Frame& frame, std::size_t begin, std::size_t end);
    using FillPalette = void(const Bones& bones, bool keeps_signs, Palette& palette);
    using PackVertexData = std::unique_ptr<const PackedVertexData>(const PackedMesh& mesh,
                                                                   std::span<const float> values);

    /// Deforms the blocks [begin, end). Agrees with the method's definition.
    ///
    /// A vertex's result depends only on its own rest point and influences and on the pose, not on its lane, its
    /// block or other vertices (for a method whose vertex data is rows by bone, up to rounding). Instruction sets
    /// may differ by rounding, since only some of them have a fused multiply-add.
    OfTargets<Deform> deform;

    /// Fills a palette. Bones that the pose lacks stay at rest.
    ///
    /// keeps_signs  give rows the signs of Pose::rotations, and keep them
    OfTargets<FillPalette> fill_palette;

    RowLayout rows;
    PackVertexData* pack_vertex_data = nullptr;  // of checked vertex data; null if the method has none
};

}  // namespace sinew
