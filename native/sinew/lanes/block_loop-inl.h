// SPDX-License-Identifier: GPL-3.0-or-later
// The loop over a mesh's blocks, and changes of points between model space and the space of the bones. Compiled once
// for each instruction set.
#if defined(SINEW_LANES_BLOCK_LOOP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_BLOCK_LOOP_INL_H_
#undef SINEW_LANES_BLOCK_LOOP_INL_H_
#else
#define SINEW_LANES_BLOCK_LOOP_INL_H_
#endif

#include "sinew/lanes/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

/// Calls on_set(b, after) for consecutive blocks of [begin, end) with the same bones, possibly none, and on_own(b) for
/// a block whose vertices have their own.
template <class OnSet, class OnOwn>
HWY_INLINE void for_each_set(const PackedMesh& mesh, std::size_t begin, std::size_t end, const OnSet& on_set,
                             const OnOwn& on_own) {
    const Block* const blocks = mesh.blocks.data();
    for (std::size_t b = begin; b < end;) {
        const Block& first = blocks[b];
        std::size_t after = b + 1;
        if (first.own_bones) {
            on_own(b);
        } else {
            // A set without bones has no entry in PackedMesh::bones, so the numbers of influences are compared, too.
            while (after < end && !blocks[after].own_bones && blocks[after].first_bone == first.first_bone &&
                   blocks[after].influences == first.influences) {
                ++after;
            }
            on_set(b, after);
        }
        b = after;
    }
}

/// Writes the rest points of blocks [begin, end), which have no bones.
inline void keep_blocks(const Frame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    for (std::size_t b = begin; b < end; ++b) {
        const Block& block = pointers.blocks[b];
        const std::size_t lanes = lanes_end(d, block);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            store_points(d, pointers, b, lane, load_points(d, pointers, b, lane));
        }
    }
}

/// for_each_set() over the blocks of a frame. Vertices without bones keep their rest points.
template <class OnSet, class OnOwn>
HWY_INLINE void for_each_set(const Frame& frame, std::size_t begin, std::size_t end, const OnSet& on_set,
                             const OnOwn& on_own) {
    for_each_set(
        *frame.mesh, begin, end,
        [&](std::size_t b, std::size_t after) HWY_ATTR {
            frame.mesh->blocks[b].influences == 0 ? keep_blocks(frame, b, after) : on_set(b, after);
        },
        on_own);
}

/// A point of model space in the space of the bones.
template <class D>
HWY_INLINE Points<D> to_bones(D d, const Spaces& spaces, const Points<D>& p) {
    return spaces.bones_from_model == nullptr ? p : displaced(d, spaces.bones_from_model, p);
}

/// The rest points of block `b`, in the space of the bones.
template <class D>
HWY_INLINE Points<D> load_rest(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                               std::size_t lane) {
    return to_bones(d, spaces, load_points(d, pointers, b, lane));
}

/// Stores points that are in the space of the bones.
template <class D>
HWY_INLINE void store_in_model(D d, const MeshPointers& pointers, const Spaces& spaces, std::size_t b,
                               std::size_t lane, Points<D> points) {
    if (spaces.model_from_bones != nullptr) points = displaced(d, spaces.model_from_bones, points);
    store_points(d, pointers, b, lane, points);
}

/// A vector of the space of the bones in model space.
template <class D>
HWY_INLINE Points<D> vector_to_model(D d, const Spaces& spaces, const Points<D>& v) {
    return spaces.model_from_bones == nullptr ? v : displaced_vector(d, spaces.model_from_bones, v);
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
