// SPDX-License-Identifier: GPL-3.0-or-later
// Linear blending on lanes. A bone is the columns x, y, z and translation of its displacement, each followed by a
// 0. Bones are summed as described at Palette.
#include "sinew/methods/lbs/lbs.h"

#include <cstring>
#include <limits>

#include "sinew/transform/convert.h"

#define SINEW_THIS_FILE "sinew/methods/lbs/lbs.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/block_loop-inl.h"
#include "sinew/lanes/bones-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {
namespace {

/// Returns `v`, and keeps GCC from loading it again for each of its uses. On AVX-512, where the kernel is bound
/// by loads, the reloads cost a tenth of its time.
template <class V>
HWY_INLINE V in_register(V v) {
#if HWY_ARCH_X86 && HWY_COMPILER_GCC_ACTUAL && HWY_TARGET != HWY_SCALAR
    asm("" : "+v"(v.raw));
#endif
    return v;
}

/// Columns of a bone's displacement.
inline constexpr std::size_t kLbsColumns = 4;

/// The numbers in these columns.
inline constexpr std::size_t kColumns = 4 * kLbsColumns;

/// Returns `columns`, and hides from the compiler that the numbers are the same for all blocks. It would
/// otherwise keep each number broadcast to a vector on the stack, which triples the bytes to read.
HWY_INLINE const float* loaded_anew(const float* columns) {
#if HWY_COMPILER_GCC || HWY_COMPILER_CLANG
    asm volatile("" : "+r"(columns) : : "memory");
#endif
    return columns;
}

/// A bone's columns, or stored differences of them.
struct Columns {
    const float* columns;

    template <class D>
    HWY_INLINE Vec<D> at(D d, std::size_t i) const {
        return hn::Set(d, columns[i]);
    }
};

/// The differences of a bone's columns from those of the first bone.
struct Differences {
    const float* columns;
    const float* first;

    template <class D>
    HWY_INLINE Vec<D> at(D d, std::size_t i) const {
        return hn::Sub(hn::Set(d, columns[i]), hn::Set(d, first[i]));
    }
};

/// add_bone() for one coordinate.
template <std::size_t kVectors, bool kWeighted, class D, class Bone>
HWY_INLINE void add_along(D d, const Bone& bone, std::size_t row, Vec<D> Points<D>::*axis,
                          const Vec<D>* weight, const Points<D>* p, Points<D>* sum) {
    const Vec<D> x = bone.at(d, row);
    const Vec<D> y = bone.at(d, 4 + row);
    const Vec<D> z = bone.at(d, 8 + row);
    const Vec<D> translation = bone.at(d, 12 + row);
    for (std::size_t v = 0; v < kVectors; ++v) {
        const Vec<D> moved = hn::MulAdd(x, p[v].x, hn::MulAdd(y, p[v].y, hn::MulAdd(z, p[v].z, translation)));
        sum[v].*axis = kWeighted ? hn::MulAdd(weight[v], moved, sum[v].*axis) : hn::Add(moved, sum[v].*axis);
    }
}

/// Adds to each of kVectors `sum` the displacement of `p` by the bone, times `weight` if kWeighted.
template <std::size_t kVectors, bool kWeighted, class D, class Bone>
HWY_INLINE void add_bone(D d, const Bone& bone, const Vec<D>* weight, const Points<D>* p, Points<D>* sum) {
    // One coordinate after the other, so that few of the bone's numbers are in registers at once. Not a lambda,
    // because those are sometimes called instead of inlined.
    add_along<kVectors, kWeighted>(d, bone, 0, &Points<D>::x, weight, p, sum);
    add_along<kVectors, kWeighted>(d, bone, 1, &Points<D>::y, weight, p, sum);
    add_along<kVectors, kWeighted>(d, bone, 2, &Points<D>::z, weight, p, sum);
}

/// The columns of the base of an absolute sum.
alignas(16) inline constexpr float kNoColumns[kColumns] = {};

/// Deforms lanes [lane, lane + kVectors * N) of block `b`, whose vertices have the same bones.
///
/// rest          its rest points from these lanes on, kLanes apart
/// first_weight  null, or the weights of the first of the others, which `weights` then lacks
/// weights       of the others from these lanes on, kLanes apart
/// first         columns of the first bone, or kNoColumns
/// other_of      other_of(k) is the difference of the k-th bone from the first; for kNoColumns, bone k - 1
/// kCount        the number of bones, that of kNoColumns included, or 0 for `count`
template <std::size_t kCount, std::size_t kVectors, class D, class OtherOf>
HWY_INLINE void deform_lanes(D d, const MeshPointers& pointers, std::size_t b, std::size_t lane,
                             const float* rest, const float* first_weight, const float* weights,
                             std::size_t count, const float* first, const OtherOf& other_of) {
    const std::size_t step = hn::Lanes(d);
    Points<D> p[kVectors];
    Points<D> sum[kVectors];
    Vec<D> weight[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v, rest += step) {
        sum[v] = p[v] = {hn::Load(d, rest), hn::Load(d, rest + kLanes), hn::Load(d, rest + 2 * kLanes)};
    }
    add_bone<kVectors, false>(d, Columns{first}, weight, p, sum);
    for (std::size_t k = 1; k < (kCount > 0 ? kCount : count); ++k) {
        const bool is_apart = kCount == 0 && k == 1 && first_weight != nullptr;
        const float* const from = is_apart ? first_weight : weights;
        for (std::size_t v = 0; v < kVectors; ++v) weight[v] = in_register(hn::Load(d, from + v * step));
        if (!is_apart) weights += kLanes;
        add_bone<kVectors, true>(d, other_of(k), weight, p, sum);
    }
    for (std::size_t v = 0; v < kVectors; ++v) store_points(d, pointers, b, lane + v * step, sum[v]);
}

HWY_INLINE const float* columns_of_bone(const Frame& frame, std::int32_t bone) {
    return frame.palette->bones[kLbsColumns * static_cast<std::size_t>(bone)].value.data();
}

template <std::size_t kCount, class OtherOf>
HWY_INLINE void deform_each(const Frame& frame, std::size_t begin, std::size_t end, const float* first,
                            const OtherOf& other_of) {
    const Full d;
    // Broadcasting each of a bone's numbers once for two vectors saves a quarter of the time on AVX2.
    constexpr std::size_t kVectors = hn::MaxLanes(Full()) < kLanes ? 2 : 1;
    const MeshPointers pointers = pointers_of(frame);
    const bool is_absolute = kCount == 0 && first == kNoColumns;
    const std::size_t influences = kCount > 0 ? kCount : pointers.blocks[begin].influences;
    // The data of these blocks is contiguous. Finding it anew for each takes 3 % more instructions.
    const float* rest = pointers.rest_points[kPointRows * begin].lane.data();
    const float* weights = weights_of(pointers, begin);
    for (std::size_t b = begin; b < end; ++b) {
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += kVectors * hn::Lanes(d)) {
            deform_lanes<kCount, kVectors>(
                d, pointers, b, lane, rest + lane, is_absolute ? first_weights_of(frame, b) + lane : nullptr,
                weights + lane, influences + (is_absolute ? 1 : 0), first, other_of);
        }
        rest += kLanes * kPointRows;
        weights += kLanes * (influences - 1);
    }
}

/// Deforms blocks [begin, end) with the same bones.
template <std::size_t kCount>
void deform_set(const Frame& frame, std::size_t begin, std::size_t end) {
    const std::int32_t* const bones = &frame.mesh->bones[frame.mesh->blocks[begin].first_bone];
    const float* const first = columns_of_bone(frame, bones[0]);
    // Stored differences can not be loaded again at once; for a single block this takes longer than it saves.
    if (kCount == 0 || end - begin == 1) {
        return deform_each<kCount>(frame, begin, end, first, [&](std::size_t k) HWY_ATTR {
            return Differences{columns_of_bone(frame, bones[k]), first};
        });
    }
    const hn::CappedTag<float, kColumns> d;
    alignas(64) float columns[(kCount > 0 ? kCount : 1) * kColumns];
    for (std::size_t i = 0; i < kColumns; i += hn::Lanes(d)) {
        for (std::size_t k = 1; k < kCount; ++k) {
            const float* const bone = columns_of_bone(frame, bones[k]);
            hn::Store(hn::Sub(hn::LoadU(d, bone + i), hn::LoadU(d, first + i)), d,
                      columns + kColumns * k + i);
        }
    }
    deform_each<kCount>(frame, begin, end, first,
                        [&](std::size_t k) HWY_ATTR { return Columns{loaded_anew(columns + kColumns * k)}; });
}

/// Deforms blocks [begin, end) with the same bones, by their absolute sum (Palette).
inline void deform_absolute_set(const Frame& frame, std::size_t begin, std::size_t end) {
    const std::int32_t* const bones = &frame.mesh->bones[frame.mesh->blocks[begin].first_bone];
    deform_each<0>(frame, begin, end, kNoColumns,
                   [&](std::size_t k) HWY_ATTR { return Columns{columns_of_bone(frame, bones[k - 1])}; });
}

#if HWY_TARGET != HWY_SCALAR

/// Deforms one vertex, with x, y and z in the lanes: its operations are those of a vertex in deform_lanes(), in their order.
///
/// rest     the vertex's rest point: numbers kLanes apart
/// weights  its weights: numbers kLanes apart
/// to       the vertex's point
HWY_INLINE void deform_vertex(const Frame& frame, const std::int32_t* bones, std::size_t count,
                              const float* rest, const float* weights, Vec3<float>* to) {
    const Four four;
    using V4 = Vec<Four>;
    const V4 x = hn::Set(four, rest[0]);
    const V4 y = hn::Set(four, rest[kLanes]);
    const V4 z = hn::Set(four, rest[2 * kLanes]);
    const auto moved_by = [&](const V4* columns) HWY_ATTR {
        return hn::MulAdd(columns[0], x, hn::MulAdd(columns[1], y, hn::MulAdd(columns[2], z, columns[3])));
    };
    // Not through memory: a vector load of something just stored in parts has to wait for it.
    V4 sum = hn::IfThenElse(hn::FirstN(four, 1), x, hn::IfThenElse(hn::FirstN(four, 2), y, z));
    V4 first[kLbsColumns];
    const bool is_absolute = is_summed_absolutely(*frame.palette, bones, count);
    const float* const stored_first = is_absolute ? kNoColumns : columns_of_bone(frame, bones[0]);
    for (std::size_t c = 0; c < kLbsColumns; ++c) first[c] = hn::Load(four, stored_first + 4 * c);
    sum = hn::Add(moved_by(first), sum);
    for (std::size_t k = is_absolute ? 0 : 1; k < count; ++k) {
        const float* const stored = columns_of_bone(frame, bones[k]);
        V4 columns[kLbsColumns];
        for (std::size_t c = 0; c < kLbsColumns; ++c) {
            columns[c] = hn::Sub(hn::Load(four, stored + 4 * c), first[c]);
        }
        sum = hn::MulAdd(hn::Set(four, weights[kLanes * k]), moved_by(columns), sum);
    }
    alignas(16) float point[4];
    hn::Store(sum, four, point);
    std::memcpy(to, point, sizeof(Vec3<float>));
}

inline void deform_own_bones(const Frame& frame, std::size_t b) {
    const Block& block = frame.mesh->blocks[b];
    const float* const rest = frame.rest_points[kPointRows * b].lane.data();
    const float* const weights = frame.mesh->weights[block.first_weight].lane.data();
    const std::int32_t* bones = &frame.mesh->bones[block.first_bone];
    for (std::size_t lane = 0; lane < block.vertices; ++lane, bones += block.influences) {
        deform_vertex(frame, bones, block.influences, rest + lane, weights + lane,
                      frame.points + frame.mesh->vertices[b].lane[lane]);
    }
}

#else

inline void deform_own_bones(const Frame& frame, std::size_t b) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    const Block& block = pointers.blocks[b];
    const float* const weights = weights_of(pointers, b);
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const std::int32_t* const bones = &frame.mesh->bones[block.first_bone + lane * block.influences];
        const bool is_absolute = is_summed_absolutely(*frame.palette, bones, block.influences);
        const Points<One> p = load_points(d, pointers, b, lane);
        Points<One> sum = p;
        const float* const first = is_absolute ? kNoColumns : columns_of_bone(frame, bones[0]);
        Vec<One> weight = hn::Zero(d);
        add_bone<1, false>(d, Columns{first}, &weight, &p, &sum);
        for (std::size_t k = is_absolute ? 0 : 1; k < block.influences; ++k) {
            weight = hn::Load(d, weights + kLanes * k + lane);
            add_bone<1, true>(d, Differences{columns_of_bone(frame, bones[k]), first}, &weight, &p, &sum);
        }
        store_points(d, pointers, b, lane, sum);
    }
}

#endif

void deform_sets(const Frame& frame, std::size_t begin, std::size_t end) {
    const Block& block = frame.mesh->blocks[begin];
    if (is_summed_absolutely(*frame.palette, &frame.mesh->bones[block.first_bone], block.influences)) {
        return deform_absolute_set(frame, begin, end);
    }
    // With a fixed count the loop is unrolled.
    switch (block.influences) {
        case 1: return deform_set<1>(frame, begin, end);
        case 2: return deform_set<2>(frame, begin, end);
        case 3: return deform_set<3>(frame, begin, end);
        case 4: return deform_set<4>(frame, begin, end);
        case 5: return deform_set<5>(frame, begin, end);
        case 6: return deform_set<6>(frame, begin, end);
        case 7: return deform_set<7>(frame, begin, end);
        case 8: return deform_set<8>(frame, begin, end);
        default: return deform_set<0>(frame, begin, end);
    }
}

/// Writes the columns of each bone's displacement, for bones that are posed in any space, in double.
void rows_between_spaces(const Bones& bones, Palette& palette) {
    const auto bones_from_model = cast<double>(bones.pose.bones_from_model);
    const Affine<double> model_from_bones = inverse(bones_from_model);
    for (std::size_t i = 0; i < bones.posed; ++i) {
        const Affine<double> motion = model_from_bones * cast<double>(bones.motion(i)) * bones_from_model;
        const Mat3<double> m = motion.linear - Mat3<double>(1.0);
        Float4* const columns = &palette.bones[kLbsColumns * i];
        for (int c = 0; c < 3; ++c) columns[c] = float4(m[c].x, m[c].y, m[c].z, 0.0);
        const Vec3<double>& translation = motion.translation;
        columns[3] = float4(translation.x, translation.y, translation.z, 0.0);
        palette.sizes[i] =
            size_of(translation, glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
    }
}

#if HWY_TARGET != HWY_SCALAR

/// Writes them for bones that are posed in model space.
void rows_in_model(const Bones& bones, Palette& palette) {
    const hn::CappedTag<float, 4> d;
    const auto three = hn::FirstN(d, 3);
    // The identity's columns as whole vectors, so that each takes one load.
    alignas(16) static constexpr float kIdentity[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    for (std::size_t i = 0; i < bones.posed; ++i) {
        const float* const from = &bones.motion(i).linear[0].x;
        float* const to = palette.bones[kLbsColumns * i].value.data();
        auto squares = hn::Zero(d);
        for (std::size_t c = 0; c < 3; ++c) {
            const auto column = hn::IfThenElseZero(three, hn::LoadU(d, from + 3 * c));
            const auto displacement = hn::Sub(column, hn::Load(d, kIdentity[c]));
            squares = hn::MulAdd(displacement, displacement, squares);
            hn::Store(displacement, d, to + 4 * c);
        }
        // Loaded from one number earlier, as there may be none behind the last.
        const auto translation = hn::ShiftRightLanes<1>(d, hn::LoadU(d, from + 8));
        hn::Store(translation, d, to + 12);
        const float size = hn::GetLane(hn::SumOfLanes(d, hn::Mul(translation, translation)));
        const float length = hn::GetLane(hn::SumOfLanes(d, squares));
        palette.sizes[i] = length < kMaxStretchSquared ? std::max(size, kMinSize * kMinSize)
                                                       : std::numeric_limits<float>::infinity();
    }
}

#else

void rows_in_model(const Bones& bones, Palette& palette) { rows_between_spaces(bones, palette); }

#endif

}  // namespace

struct LbsKernel {
    static constexpr RowLayout kRows{.float4s = kLbsColumns, .have_scales = false};

    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        for_each_set(
            frame, begin, end,
            [&](std::size_t b, std::size_t after) HWY_ATTR { deform_sets(frame, b, after); },
            [&](std::size_t b) HWY_ATTR { deform_own_bones(frame, b); });
    }

    static void fill_palette(const Bones& bones, bool, Palette& palette) {
        palette.any_scale = palette.keeps_signs = false;
        const std::size_t at_rest = bones.used.size() - bones.posed;
        std::fill_n(palette.bones + kLbsColumns * bones.posed, kLbsColumns * at_rest, Float4{});
        std::fill_n(palette.sizes + bones.posed, at_rest, kMinSize * kMinSize);
        is_identity(bones.pose.bones_from_model) ? rows_in_model(bones, palette)
                                                 : rows_between_spaces(bones, palette);
        find_absolute_sums(bones, palette);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Lbs, LbsKernel)
