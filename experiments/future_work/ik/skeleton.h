// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sinew/base/fail.h"

namespace sinew {

/// A hierarchy of bones in which every parent precedes its children, so that a single loop visits parents first.
/// A constructed object is valid.
class Skeleton {
public:
    /// parents  [bones] index of each bone's parent, -1 for a root
    ///
    /// Throws std::invalid_argument if a parent does not precede its child.
    explicit Skeleton(std::span<const std::int32_t> parents) : parents_(parents.begin(), parents.end()) {
        for (std::size_t bone = 0; bone < parents_.size(); ++bone) {
            const std::int32_t parent = parents_[bone];
            if (parent < -1 || (parent >= 0 && static_cast<std::size_t>(parent) >= bone)) {
                fail("parents", "-1 or the index of an earlier bone",
                     std::to_string(parent) + " for bone " + std::to_string(bone));
            }
        }
    }

    [[nodiscard]] std::size_t bone_count() const noexcept { return parents_.size(); }
    [[nodiscard]] std::span<const std::int32_t> parents() const noexcept { return parents_; }

private:
    std::vector<std::int32_t> parents_;
};

}  // namespace sinew
