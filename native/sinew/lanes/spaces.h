// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/lanes/palette.h"

namespace sinew {

/// Displacement rows that change points from model space to the space of the bones, and back. Null if both are the
/// same space.
struct Spaces {
    const float* bones_from_model = nullptr;
    const float* model_from_bones = nullptr;
};

/// These rows.
class SpaceRows {
public:
    /// bones_from_model  invertible
    explicit SpaceRows(const Affine<float>& bones_from_model) noexcept
        : are_same_(is_identity(bones_from_model)) {
        if (are_same_) return;
        const auto transform = cast<double>(bones_from_model);
        write_displacement(transform, bones_from_model_.data());
        write_displacement(inverse(transform), model_from_bones_.data());
    }

    [[nodiscard]] Spaces spaces() const noexcept {
        if (are_same_) return {};
        return {bones_from_model_.front().value.data(), model_from_bones_.front().value.data()};
    }

private:
    bool are_same_;
    std::array<Float4, kDisplacementRows> bones_from_model_;
    std::array<Float4, kDisplacementRows> model_from_bones_;
};

}  // namespace sinew
