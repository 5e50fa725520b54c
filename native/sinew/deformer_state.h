// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sinew/deformer.h"
#include "sinew/methods/packed_binding.h"
#include "sinew/pose/palette_store.h"
#include "sinew/stages/mix/mix_blocks.h"

namespace sinew {

/// What the kernels of a deformer read of a frame: prepared once, for any rest points.
struct PreparedPose {
    /// One more than the maximum, which may be 0.
    using ParameterValues = std::array<double, kMaxMethodParameters + 1>;

    SpaceRows space_rows;
    // of the method, and of the one that the stage `mix` adds
    std::array<ParameterValues, 2> parameters{};
    std::array<const Palette*, 2> palettes{};
};

struct Deformer::State {
    State(std::shared_ptr<const PackedBinding> from, const MethodInfo& method,
          const std::optional<MixData>& mix_data);

    [[nodiscard]] std::span<const Kernel* const> kernels_in_use() const {
        return std::span(kernels).first(mix ? 2 : 1);
    }

    [[nodiscard]] std::span<const Lanes<float>> rest_points() const {
        return own_rest_points.empty() ? std::span(packed->mesh.rest_points) : std::span(own_rest_points);
    }

    /// Fills the palettes of `reading`, which the result refers to.
    [[nodiscard]] PreparedPose prepare(const Pose& pose, const DeformOptions& options,
                                       const PaletteStore::Reading& reading) const noexcept;

    /// Deforms rest points in the form of PackedMesh::rest_points.
    ///
    /// points  [vertices]
    void deform(const PreparedPose& pose, std::span<const Lanes<float>> rest_points, std::size_t threads,
                Vec3<float>* points) const noexcept;

    std::shared_ptr<const PackedBinding> packed;
    std::vector<Lanes<float>> own_rest_points;  // empty: use those of the binding
    std::array<std::size_t, 2> methods;         // indices into Methods; the second is that of the mix
    std::array<const Kernel*, 2> kernels;
    std::optional<MixWeights> mix;
    BoneSets sets;  // empty unless a kernel needs sets
    mutable PaletteStore palettes;

private:
    [[nodiscard]] BoneSets wanted_sets() const;
};

}  // namespace sinew
