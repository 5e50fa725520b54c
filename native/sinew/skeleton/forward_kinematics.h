// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "sinew/skeleton/skeleton.h"

namespace sinew {

/// Computes each bone's transform relative to the root: its parent's times its own (Smith 2013, algorithm 1).
///
/// root_from_parentless  applied after the transform of every bone without a parent
/// parent_from_bone      [bones] each bone relative to its parent
/// root_from_bone        [bones] the result; may be the same memory as parent_from_bone
///
/// Returns false, and writes nothing, if a size is wrong. Transform is Affine, QuatVec or DualQuat of any scalar type.
template <class Transform>
[[nodiscard]] bool root_relative(const Skeleton& skeleton, const Transform& root_from_parentless,
                                 std::span<const Transform> parent_from_bone,
                                 std::span<Transform> root_from_bone) noexcept {
    const std::span<const std::int32_t> parents = skeleton.parents();
    if (parent_from_bone.size() != parents.size() || root_from_bone.size() != parents.size()) return false;
    for (std::size_t bone = 0; bone < parents.size(); ++bone) {
        const std::int32_t parent = parents[bone];
        const Transform& before =
            parent < 0 ? root_from_parentless : root_from_bone[static_cast<std::size_t>(parent)];
        root_from_bone[bone] = before * parent_from_bone[bone];
    }
    return true;
}

/// Whether `bone` is `top` or one of its descendants. Both are bones of the skeleton.
[[nodiscard]] inline bool is_in_branch(const Skeleton& skeleton, std::size_t bone, std::size_t top) noexcept {
    auto at = static_cast<std::int32_t>(bone);
    // Parents precede their children, so a bone before `top` is not its descendant.
    while (at > static_cast<std::int32_t>(top)) at = skeleton.parents()[static_cast<std::size_t>(at)];
    return at == static_cast<std::int32_t>(top);
}

/// root_relative() of one bone and its descendants alone, after a change of that bone (Smith 2013, algorithm 1, called
/// for a bone). The other elements of `root_from_bone` are not changed.
///
/// Returns false, and writes nothing, if a size is wrong, or if there is no bone `top`.
template <class Transform>
[[nodiscard]] bool update_branch(const Skeleton& skeleton, const Transform& root_from_parentless,
                                 std::span<const Transform> parent_from_bone, std::size_t top,
                                 std::span<Transform> root_from_bone) noexcept {
    const std::span<const std::int32_t> parents = skeleton.parents();
    if (parent_from_bone.size() != parents.size() || root_from_bone.size() != parents.size() ||
        top >= parents.size()) {
        return false;
    }
    for (std::size_t bone = top; bone < parents.size(); ++bone) {
        if (!is_in_branch(skeleton, bone, top)) continue;
        const std::int32_t parent = parents[bone];
        const Transform& before =
            parent < 0 ? root_from_parentless : root_from_bone[static_cast<std::size_t>(parent)];
        root_from_bone[bone] = before * parent_from_bone[bone];
    }
    return true;
}

}  // namespace sinew
