// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sinew/export.h"

namespace sinew {

/// A hierarchy of bones in which every parent precedes its children, so that a single loop visits parents first.
/// A constructed object is valid.
class SINEW_EXPORT Skeleton {
public:
    /// parents  [bones] index of each bone's parent, -1 for a root
    ///
    /// Throws std::invalid_argument if a parent does not precede its child.
    explicit Skeleton(std::span<const std::int32_t> parents);

    [[nodiscard]] std::size_t bone_count() const noexcept { return parents_.size(); }
    [[nodiscard]] std::span<const std::int32_t> parents() const noexcept { return parents_; }

private:
    std::vector<std::int32_t> parents_;
};

}  // namespace sinew
