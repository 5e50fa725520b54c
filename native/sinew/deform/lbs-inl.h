// SPDX-License-Identifier: GPL-3.0-or-later
// Linear blend on blocks: compiled once for each instruction set, see kernels.cpp.
//
#if defined(SINEW_DEFORM_LBS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SINEW_DEFORM_LBS_INL_H_
#undef SINEW_DEFORM_LBS_INL_H_
#else
#define SINEW_DEFORM_LBS_INL_H_
#endif

#include "sinew/deform/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

/// The weighted sum of columns: numbers 0 to 2 of each.
template <class D>
struct Columns {
    Vec<D> x[3];
    Vec<D> y[3];
    Vec<D> z[3];
    Vec<D> shift[3];
};

template <class D>
HWY_INLINE Columns<D> scaled_columns(D d, Vec<D> weight, const float* columns) {
    Columns<D> result;
    for (std::size_t i = 0; i < 3; ++i) {
        result.x[i] = hn::Mul(weight, hn::Set(d, columns[i]));
        result.y[i] = hn::Mul(weight, hn::Set(d, columns[4 + i]));
        result.z[i] = hn::Mul(weight, hn::Set(d, columns[8 + i]));
        result.shift[i] = hn::Mul(weight, hn::Set(d, columns[12 + i]));
    }
    return result;
}

template <class D>
HWY_INLINE void add_columns(D d, Vec<D> weight, const float* columns, Columns<D>& sum) {
    for (std::size_t i = 0; i < 3; ++i) {
        sum.x[i] = hn::MulAdd(weight, hn::Set(d, columns[i]), sum.x[i]);
        sum.y[i] = hn::MulAdd(weight, hn::Set(d, columns[4 + i]), sum.y[i]);
        sum.z[i] = hn::MulAdd(weight, hn::Set(d, columns[8 + i]), sum.z[i]);
        sum.shift[i] = hn::MulAdd(weight, hn::Set(d, columns[12 + i]), sum.shift[i]);
    }
}

template <class V>
HWY_INLINE V displaced_by(V p, V x, V y, V z, V column_x, V column_y, V column_z, V shift) {
    return hn::Add(p, hn::MulAdd(column_x, x, hn::MulAdd(column_y, y, hn::MulAdd(column_z, z, shift))));
}

/// Lanes [lane, lane + N) of block `b`.
///
/// bones   those of all these lanes
/// kCount  the number of influences, or 0 for any
template <std::size_t kCount, class D>
HWY_INLINE void deform_lanes(D d, const Frame& frame, std::size_t b, std::size_t lane,
                             const std::int32_t* bones) {
    const Block& block = frame.mesh->blocks[b];
    const Lanes<float>* const rows = &frame.mesh->rows[block.first_row];
    const Quad* const palette = frame.palette->bones.data();
    const auto columns = [palette, bones](std::size_t k) {
        return palette[kLbsQuads * static_cast<std::size_t>(bones[k])].value.data();
    };
    Columns<D> sum = scaled_columns(d, hn::Load(d, rows[3].lane.data() + lane), columns(0));
    for (std::size_t k = 1; k < (kCount > 0 ? kCount : block.influences); ++k) {
        add_columns(d, hn::Load(d, rows[3 + k].lane.data() + lane), columns(k), sum);
    }
    const Points<D> p = load_points(d, rows, lane);
    store_points(d, frame, b, lane,
                 {displaced_by(p.x, p.x, p.y, p.z, sum.x[0], sum.y[0], sum.z[0], sum.shift[0]),
                  displaced_by(p.y, p.x, p.y, p.z, sum.x[1], sum.y[1], sum.z[1], sum.shift[1]),
                  displaced_by(p.z, p.x, p.y, p.z, sum.x[2], sum.y[2], sum.z[2], sum.shift[2])});
}

template <std::size_t kCount>
HWY_INLINE void deform_set(const Frame& frame, std::size_t b) {
    const Full d;
    const Block& block = frame.mesh->blocks[b];
    for (std::size_t lane = 0; lane < block.vertices; lane += hn::Lanes(d)) {
        deform_lanes<kCount>(d, frame, b, lane, &frame.mesh->bones[block.first_bone]);
    }
}

#if HWY_TARGET != HWY_SCALAR

/// A mixed block vertex by vertex, x, y and z in the lanes: the same operations in the same order.
inline void deform_mixed(const Frame& frame, std::size_t b) {
    const hn::CappedTag<float, 4> four;
    using V4 = Vec<hn::CappedTag<float, 4>>;
    const Block& block = frame.mesh->blocks[b];
    const Lanes<float>* const rows = &frame.mesh->rows[block.first_row];
    const std::int32_t* bones = &frame.mesh->bones[block.first_bone];
    const auto first = hn::FirstN(four, 1);
    const auto first_two = hn::FirstN(four, 2);
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const V4 x = hn::Set(four, rows[0].lane[lane]);
        const V4 y = hn::Set(four, rows[1].lane[lane]);
        const V4 z = hn::Set(four, rows[2].lane[lane]);
        V4 sum[kLbsQuads];
        for (std::size_t k = 0; k < block.influences; ++k, ++bones) {
            const Quad* const columns = &frame.palette->bones[kLbsQuads * static_cast<std::size_t>(*bones)];
            const V4 weight = hn::Set(four, rows[3 + k].lane[lane]);
            for (std::size_t c = 0; c < kLbsQuads; ++c) {
                const V4 column = hn::Load(four, columns[c].value.data());
                sum[c] = k == 0 ? hn::Mul(weight, column) : hn::MulAdd(weight, column, sum[c]);
            }
        }
        // Not by way of memory: a vector load of what was just stored in parts waits for it.
        const V4 p = hn::IfThenElse(first, x, hn::IfThenElse(first_two, y, z));
        const V4 deformed = displaced_by(p, x, y, z, sum[0], sum[1], sum[2], sum[3]);
        alignas(16) float point[4];
        hn::Store(deformed, four, point);
        const auto vertex = static_cast<std::size_t>(frame.mesh->vertices[b].lane[lane]);
        std::memcpy(&frame.points[vertex], point, sizeof(Vec3<float>));
    }
}

#else

inline void deform_mixed(const Frame& frame, std::size_t b) {
    const Block& block = frame.mesh->blocks[b];
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        deform_lanes<0>(One(), frame, b, lane,
                        &frame.mesh->bones[block.first_bone + lane * block.influences]);
    }
}

#endif

inline void deform_lbs(const Frame& frame, std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
        const Block& block = frame.mesh->blocks[b];
        if (block.mixed) {
            deform_mixed(frame, b);
            continue;
        }
        // A fixed count makes one run of instructions.
        switch (block.influences) {
            case 0: keep_block(frame, b); break;
            case 1: deform_set<1>(frame, b); break;
            case 2: deform_set<2>(frame, b); break;
            case 3: deform_set<3>(frame, b); break;
            case 4: deform_set<4>(frame, b); break;
            default: deform_set<0>(frame, b); break;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#endif
