// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skeleton/skeleton.h"

#include <string>

#include "sinew/base/fail.h"

namespace sinew {

Skeleton::Skeleton(std::span<const std::int32_t> parents) : parents_(parents.begin(), parents.end()) {
    for (std::size_t bone = 0; bone < parents_.size(); ++bone) {
        const std::int32_t parent = parents_[bone];
        if (parent < -1 || (parent >= 0 && static_cast<std::size_t>(parent) >= bone)) {
            fail("parents", "-1 or the index of an earlier bone",
                 std::to_string(parent) + " for bone " + std::to_string(bone));
        }
    }
}

}  // namespace sinew
