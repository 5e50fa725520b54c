// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sinew/base/targets.h"
#include "sinew/lanes/palette.h"
#include "sinew/mesh/packed_mesh.h"

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

/// How the library deforms whole meshes with one method: five functions. Registered in methods/NAME/NAME.cpp by
/// SINEW_KERNEL.
struct Kernel {
    using PackVertexData = std::unique_ptr<const PackedVertexData>(const PackedMesh& mesh,
                                                                   std::span<const float> values);
    using OfBones = void(const Bones& bones, Palette& palette);
    using Deform = void(const Frame& frame, std::size_t begin, std::size_t end);

    /// Deforms the blocks [begin, end). Agrees with the method's definition.
    ///
    /// A vertex's result depends only on its own rest point and influences and on the pose, not on its lane, its
    /// block or other vertices (for a method whose vertex data is rows by bone, up to rounding). Instruction sets
    /// may differ by rounding, since only some of them have a fused multiply-add.
    OfTargets<Deform> deform;

    /// The rows in Palette::bones of a bone that does not move. Every bone there has as many.
    std::span<const Float4> rest_row;

    /// How many Float4 of a row change sign with the rotation; 0 if the signs can not be kept.
    std::size_t signed_float4s = 0;

    /// Writes the rows of bones.used, all of which are posed, and their sizes. A method that blends rotations
    /// treats every bone as rigid, and adds the indices of those that are not to palette.scaled.
    OfTargets<OfBones> bone_rows{};

    /// Writes the rows and scales of the bones in palette.scaled. Null for a method that has no use for them: it
    /// changes the space in the rows of bones.
    OfBones* scaled_bone_rows = nullptr;

    /// In place of both, for a method with a row for each bone of each set of bones: writes those, from
    /// palette.posed. Else null.
    OfBones* set_rows = nullptr;

    /// Packs checked vertex data [MethodInfo::vertex_floats for each vertex or row]. Null if the method has none.
    PackVertexData* pack_vertex_data = nullptr;

    /// The number of rows in a palette.
    [[nodiscard]] std::size_t row_count(std::size_t bones, std::size_t entries_of_sets) const noexcept {
        return set_rows != nullptr ? entries_of_sets : bones;
    }
    /// Whether it keeps the scale of bones apart.
    [[nodiscard]] bool keeps_scale() const noexcept {
        return scaled_bone_rows != nullptr || set_rows != nullptr;
    }
};

// Defines Method::kernel(), from the functions of the file that are compiled for each instruction set. Further
// arguments are the other members of Kernel, in their order.
#define SINEW_KERNEL(Method, ...)                                                      \
    const Kernel& Method::kernel() noexcept {                                          \
        static constexpr Kernel kKernel{.deform = SINEW_TARGETS(deform), __VA_ARGS__}; \
        return kKernel;                                                                \
    }

/// Fills `palette`. Bones that the pose lacks stay at rest.
///
/// keeps_signs  give rows the signs of Pose::rotations, and keep them
void fill_palette(const Kernel& kernel, const BonePairs& pairs, const Bones& bones, bool keeps_signs,
                  Palette& palette) noexcept;

}  // namespace sinew
