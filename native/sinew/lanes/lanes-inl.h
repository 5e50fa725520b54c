// SPDX-License-Identifier: GPL-3.0-or-later
// Points in lanes. Compiled once for each instruction set.
#if defined(SINEW_LANES_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_LANES_LANES_INL_H_
#undef SINEW_LANES_LANES_INL_H_
#else
#define SINEW_LANES_LANES_INL_H_
#endif

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "hwy/highway.h"
#include "sinew/lanes/kernel.h"

// Defines Method::kernel() from the static functions of a struct that is compiled for each instruction set, and the
// layout of its rows. Further arguments are other members of Kernel.
#undef SINEW_KERNEL
#if HWY_ONCE
#define SINEW_KERNEL(Method, Struct, ...)                                                    \
    namespace sinew {                                                                        \
    const Kernel& Method::kernel() noexcept {                                                \
        static constexpr Kernel kKernel{.deform = SINEW_TARGETS(Struct::deform),             \
                                        .fill_palette = SINEW_TARGETS(Struct::fill_palette), \
                                        .rows = HWY_NAMESPACE::Struct::kRows,                \
                                        __VA_ARGS__};                                        \
        return kKernel;                                                                      \
    }                                                                                        \
    }
#else
#define SINEW_KERNEL(Method, Struct, ...)
#endif

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Full = hn::CappedTag<float, kLanes>;
using One = hn::CappedTag<float, 1>;

/// A point, a quaternion or a row of four numbers at once; one number after the other where vectors have one lane.
using Four = hn::CappedTag<float, 4>;

template <class D>
using Vec = hn::Vec<D>;

/// Pointers to a frame's blocks and points. Kept as a copy on the stack, because the compiler would reload the
/// frame's own members after every stored vector.
struct MeshPointers {
    const Block* blocks;
    const Lanes<float>* rest_points;
    const Lanes<float>* weights;
    const Lanes<float>* vertex_rows;  // PackedVertexData::rows; null if there is no vertex data
    const Lanes<std::int32_t>* vertices;
    const Run* runs;
    Vec3<float>* points;
};

HWY_INLINE MeshPointers pointers_of(const Frame& frame) {
    const PackedMesh& mesh = *frame.mesh;
    return {mesh.blocks.data(),   frame.rest_points,
            mesh.weights.data(),  frame.vertex_data == nullptr ? nullptr : frame.vertex_data->rows.data(),
            mesh.vertices.data(), mesh.runs.data(),
            frame.points};
}

/// The weights of the first influence in block `b`, whose vertices have the same bones.
HWY_INLINE const float* first_weights_of(const Frame& frame, std::size_t b) {
    return frame.mesh->first_weights[b].lane.data();
}

/// Several points: each vector has one coordinate of all of them.
template <class D>
struct Points {
    Vec<D> x;
    Vec<D> y;
    Vec<D> z;
};

/// The rest points of block `b`.
template <class D>
HWY_INLINE Points<D> load_points(D d, const MeshPointers& pointers, std::size_t b, std::size_t lane) {
    const Lanes<float>* const rows = pointers.rest_points + kPointRows * b;
    return {hn::Load(d, rows[0].lane.data() + lane), hn::Load(d, rows[1].lane.data() + lane),
            hn::Load(d, rows[2].lane.data() + lane)};
}

HWY_INLINE const float* numbers_of(const Float4* float4s) { return reinterpret_cast<const float*>(float4s); }
HWY_INLINE float* numbers_of(Float4* float4s) { return reinterpret_cast<float*>(float4s); }

/// Stores four numbers for each lane.
template <class D>
HWY_INLINE void store_float4s(D d, Vec<D> a, Vec<D> b, Vec<D> c, Vec<D> e, Float4* to) {
    if constexpr (hn::MaxLanes(D()) == 1) {
        *to = {{hn::GetLane(a), hn::GetLane(b), hn::GetLane(c), hn::GetLane(e)}};
    } else {
        hn::StoreInterleaved4(a, b, c, e, d, numbers_of(to));
    }
}

/// Three consecutive rows of numbers as points.
template <class D>
HWY_INLINE Points<D> load_row_points(D d, const float* rows) {
    return {hn::Load(d, rows), hn::Load(d, rows + kLanes), hn::Load(d, rows + 2 * kLanes)};
}

/// The weights of block `b`: of all influences if its vertices have own bones, otherwise of those
/// after the first.
HWY_INLINE const float* weights_of(const MeshPointers& pointers, std::size_t b) {
    return pointers.weights[pointers.blocks[b].first_weight].lane.data();
}

/// One point, x, y and z, in all lanes.
template <class D>
HWY_INLINE Points<D> in_all_lanes(D d, const float* point) {
    return {hn::Set(d, point[0]), hn::Set(d, point[1]), hn::Set(d, point[2])};
}

template <class D>
HWY_INLINE Points<D> add(const Points<D>& a, const Points<D>& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

template <class D>
HWY_INLINE Points<D> subtract(const Points<D>& a, const Points<D>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class D>
HWY_INLINE Points<D> times(Vec<D> factor, const Points<D>& p) {
    return {hn::Mul(factor, p.x), hn::Mul(factor, p.y), hn::Mul(factor, p.z)};
}

template <class D>
HWY_INLINE Vec<D> dot(const Points<D>& a, const Points<D>& b) {
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

/// The displacement of `p` by the rows [3], each (x, y, z, translation).
template <class D>
HWY_INLINE Points<D> displacement(D d, const float* rows, const Points<D>& p) {
    const auto row = [d, &p](const float* r) HWY_ATTR {
        return hn::MulAdd(
            hn::Set(d, r[0]), p.x,
            hn::MulAdd(hn::Set(d, r[1]), p.y, hn::MulAdd(hn::Set(d, r[2]), p.z, hn::Set(d, r[3]))));
    };
    return {row(rows), row(rows + 4), row(rows + 8)};
}

template <class D>
HWY_INLINE Points<D> displaced(D d, const float* rows, const Points<D>& p) {
    return add<D>(p, displacement(d, rows, p));
}

/// A vector plus its displacement: translations do not apply.
template <class D>
HWY_INLINE Points<D> displaced_vector(D d, const float* rows, const Points<D>& v) {
    const auto along = [d, &v](const float* r, Vec<D> own) HWY_ATTR {
        return hn::MulAdd(hn::Set(d, r[0]), v.x,
                          hn::MulAdd(hn::Set(d, r[1]), v.y, hn::MulAdd(hn::Set(d, r[2]), v.z, own)));
    };
    return {along(rows, v.x), along(rows + 4, v.y), along(rows + 8, v.z)};
}

template <class D>
HWY_INLINE Points<D> cross(const Points<D>& a, const Points<D>& b) {
    return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
            hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

/// a + b x c
template <class D>
HWY_INLINE Points<D> add_cross(const Points<D>& a, const Points<D>& b, const Points<D>& c) {
    return {hn::NegMulAdd(b.z, c.y, hn::MulAdd(b.y, c.z, a.x)),
            hn::NegMulAdd(b.x, c.z, hn::MulAdd(b.z, c.x, a.y)),
            hn::NegMulAdd(b.y, c.x, hn::MulAdd(b.x, c.y, a.z))};
}

/// a + scale * b
template <class D>
HWY_INLINE Points<D> add_scaled(const Points<D>& a, Vec<D> scale, const Points<D>& b) {
    return {hn::MulAdd(scale, b.x, a.x), hn::MulAdd(scale, b.y, a.y), hn::MulAdd(scale, b.z, a.z)};
}

/// The squared length of a quaternion [4].
template <class D>
HWY_INLINE Vec<D> squared_norm(const Vec<D>* q) {
    return hn::MulAdd(q[0], q[0], hn::MulAdd(q[1], q[1], hn::MulAdd(q[2], q[2], hn::Mul(q[3], q[3]))));
}

/// The squared length of a sum of quaternions, as a divisor: finite results also where it cancels.
template <class D>
HWY_INLINE Vec<D> squared_length(D d, const Vec<D>* q) {
    return hn::Max(squared_norm<D>(q), hn::Set(d, static_cast<float>(kDegenerateBlend * kDegenerateBlend)));
}

/// `start` plus the displacement of `v` under the rotation by the quaternion `q` [4], which may have any length.
template <class D>
HWY_INLINE Points<D> add_rotation(D d, const Points<D>& start, const Vec<D>* q, const Points<D>& v) {
    const Vec<D> scale = hn::Div(hn::Set(d, 2.0f), squared_length(d, q));
    const Points<D> axis{q[1], q[2], q[3]};
    const Points<D> inner = add_scaled<D>(cross<D>(axis, v), q[0], v);
    return add_scaled<D>(start, scale, cross<D>(axis, inner));
}

/// 1 / sqrt(x) for positive finite x. A square root and a division of 16 lanes take as long as about twenty other
/// operations.
template <class D>
HWY_INLINE Vec<D> inverse_root(D d, Vec<D> x) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    // The estimate has at least 12 bits; one Newton step makes these all but the last two or three of 24.
    const auto root = hn::ApproximateReciprocalSqrt(x);
    const auto product = hn::Mul(x, root);
    const auto half = hn::Mul(root, hn::Set(d, 0.5f));
    return hn::Mul(half, hn::NegMulAdd(product, root, hn::Set(d, 3.0f)));
#else
    return hn::Div(hn::Set(d, 1.0f), hn::Sqrt(x));
#endif
}

HWY_INLINE Points<One> load_consecutive(One d, const float* from) { return in_all_lanes(d, from); }

HWY_INLINE void store_consecutive(One, const Points<One>& p, float* to) {
    to[0] = hn::GetLane(p.x);
    to[1] = hn::GetLane(p.y);
    to[2] = hn::GetLane(p.z);
}

#if HWY_TARGET == HWY_AVX3

/// x y z x y z ... of the points, in three vectors.
struct Interleaved {
    Vec<Full> part[3];
};

HWY_INLINE Interleaved interleave(const Points<Full>& p) {
    // Lane j of coordinate c is float 3 j + c of the result, and 3 j + c mod 16 is different for each j. So one
    // permute brings all values of a coordinate to their lanes, in whichever part they are. Blends run on ports
    // that do no multiply-add; with six two-source permutes instead, a whole linear blend took 9 % longer on Zen
    // 4.
    alignas(64) static constexpr std::int32_t kFrom[3][16] = {
        {0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15, 10, 5},
        {5, 0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15, 10},
        {10, 5, 0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15}};
    const __m512 x = _mm512_permutexvar_ps(_mm512_load_si512(kFrom[0]), p.x.raw);
    const __m512 y = _mm512_permutexvar_ps(_mm512_load_si512(kFrom[1]), p.y.raw);
    const __m512 z = _mm512_permutexvar_ps(_mm512_load_si512(kFrom[2]), p.z.raw);
    // Lane l of part i is float 16 i + l, which is coordinate (i + l) mod 3.
    constexpr __mmask16 kEveryThirdFrom[3] = {0x9249, 0x2492, 0x4924};
    Interleaved result;
    for (int i = 0; i < 3; ++i) {
        const __m512 xy = _mm512_mask_blend_ps(kEveryThirdFrom[(4 - i) % 3], x, y);
        result.part[i].raw = _mm512_mask_blend_ps(kEveryThirdFrom[(5 - i) % 3], xy, z);
    }
    return result;
}

/// The inverse of interleave(), in the same way.
HWY_INLINE Points<Full> deinterleave(const Interleaved& from) {
    alignas(64) static constexpr std::int32_t kFrom[3][16] = {
        {0, 3, 6, 9, 12, 15, 2, 5, 8, 11, 14, 1, 4, 7, 10, 13},
        {1, 4, 7, 10, 13, 0, 3, 6, 9, 12, 15, 2, 5, 8, 11, 14},
        {2, 5, 8, 11, 14, 1, 4, 7, 10, 13, 0, 3, 6, 9, 12, 15}};
    constexpr __mmask16 kEveryThirdFrom[3] = {0x9249, 0x2492, 0x4924};
    const auto coordinate = [&](int c) HWY_ATTR {
        __m512 all = _mm512_mask_blend_ps(kEveryThirdFrom[(c + 2) % 3], from.part[0].raw, from.part[1].raw);
        all = _mm512_mask_blend_ps(kEveryThirdFrom[(c + 1) % 3], all, from.part[2].raw);
        return Vec<Full>{_mm512_permutexvar_ps(_mm512_load_si512(kFrom[c]), all)};
    };
    return {coordinate(0), coordinate(1), coordinate(2)};
}

HWY_INLINE Points<Full> load_consecutive(Full d, const float* from) {
    return deinterleave({{hn::LoadU(d, from), hn::LoadU(d, from + kLanes), hn::LoadU(d, from + 2 * kLanes)}});
}

/// Loads whole vectors with all floats outside the run masked out. Lanes that repeat the last vertex become 0.
HWY_INLINE Points<Full> load_runs(Full d, const Run* runs, std::size_t count, const float* points) {
    Interleaved interleaved{{hn::Zero(d), hn::Zero(d), hn::Zero(d)}};
    for (std::size_t r = 0; r < count; ++r) {
        const float* const from = points + 3 * static_cast<std::ptrdiff_t>(runs[r].origin);
        for (std::size_t i = 0; i < 3; ++i) {
            __m512& part = interleaved.part[i].raw;
            part = _mm512_mask_loadu_ps(part, runs[r].floats[i], from + kLanes * i);
        }
    }
    return deinterleave(interleaved);
}

HWY_INLINE void store_consecutive(Full d, const Points<Full>& p, float* to) {
    const Interleaved points = interleave(p);
    for (std::size_t i = 0; i < 3; ++i) hn::StoreU(points.part[i], d, to + kLanes * i);
}

/// Stores whole vectors with all floats outside the run masked out.
HWY_INLINE void store_runs(Full, const Run* runs, std::size_t count, const Points<Full>& p, float* points) {
    const Interleaved interleaved = interleave(p);
    for (std::size_t r = 0; r < count; ++r) {
        float* const to = points + 3 * static_cast<std::ptrdiff_t>(runs[r].origin);
        for (std::size_t i = 0; i < 3; ++i) {
            _mm512_mask_storeu_ps(to + kLanes * i, runs[r].floats[i], interleaved.part[i].raw);
        }
    }
}

/// Transposes lanes to points and stores each point with a masked store.
///
/// Not inlined into store_points, whose stack frame would grow for every block.
inline HWY_NOINLINE void scatter_points(Full d, const std::int32_t* vertices, Vec3<float>* points,
                                        Vec<Full> x, Vec<Full> y, Vec<Full> z) {
    alignas(64) float float4s[4 * kLanes];
    hn::StoreInterleaved4(x, y, z, z, d, float4s);
    for (std::size_t i = 0; i < kLanes; ++i) {
        _mm_mask_storeu_ps(&points[vertices[i]].x, 7, _mm_load_ps(float4s + 4 * i));
    }
}

#else

template <class D>
HWY_INLINE Points<D> load_consecutive(D d, const float* from) {
    Points<D> points;
    hn::LoadInterleaved3(d, from, points.x, points.y, points.z);
    return points;
}

template <class D>
HWY_INLINE void store_consecutive(D d, const Points<D>& p, float* to) {
    hn::StoreInterleaved3(p.x, p.y, p.z, d, to);
}

#if HWY_TARGET != HWY_SCALAR

/// Not inlined into store_points, whose stack frame would grow for every block.
template <class D>
HWY_NOINLINE void scatter_points(D d, const std::int32_t* vertices, Vec3<float>* points, Vec<D> x, Vec<D> y,
                                 Vec<D> z) {
    // x and y are stored together, so a point takes two stores. These are integer stores, because a processor can
    // store two integers at once, but only one vector.
    constexpr std::size_t kMax = hn::MaxLanes(D());
    alignas(64) float pairs[2][kMax];
    alignas(64) float zs[kMax];
    hn::Store(hn::InterleaveLower(d, x, y), d, pairs[0]);
    hn::Store(hn::InterleaveUpper(d, x, y), d, pairs[1]);
    hn::Store(z, d, zs);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
        std::uint64_t pair;
        std::uint32_t third;
        std::memcpy(&pair, pairs[i % 4 / 2] + i / 4 * 4 + i % 2 * 2, sizeof(pair));
        std::memcpy(&third, zs + i, sizeof(third));
        float* const to = &points[vertices[i]].x;
        std::memcpy(to, &pair, sizeof(pair));
        std::memcpy(to + 2, &third, sizeof(third));
    }
}

#endif

#endif

/// Writes lanes [lane, lane + N) of block `b`. Lanes that repeat the last vertex write it again.
template <class D>
HWY_INLINE void store_points(D d, const MeshPointers& to, std::size_t b, std::size_t lane,
                             const Points<D>& p) {
    const Block& block = to.blocks[b];
    const std::int32_t* const vertices = to.vertices[b].lane.data() + lane;
    if constexpr (hn::MaxLanes(D()) == 1) {
        store_consecutive(d, p, &to.points[*vertices].x);
    } else {
        Vec3<float>* const points = to.points;
        if (block.consecutive) return store_consecutive(d, p, &points[block.output + lane].x);
#if HWY_TARGET == HWY_AVX3
        if (block.runs > 0) return store_runs(d, to.runs + block.output, block.runs, p, &points->x);
#endif
        scatter_points(d, vertices, points, p.x, p.y, p.z);
    }
}

/// The end of the lanes of a block to deform. A constant where one vector holds all lanes.
template <class D>
HWY_INLINE std::size_t lanes_end(D d, const Block& block) {
    return hn::MaxLanes(D()) == kLanes ? hn::Lanes(d) : block.vertices;
}

/// Whether the sum of these influences of a vertex is absolute (Palette).
HWY_INLINE bool is_summed_absolutely(const Palette& palette, const std::int32_t* bones, std::size_t count) {
    return HWY_UNLIKELY(palette.may_need_absolute_sum[bones[0]] != 0) &&
           sinew::needs_absolute_sum(palette, bones, count);
}

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
