// SPDX-License-Identifier: GPL-3.0-or-later
// Spherical deform on lanes. Rows are those of CentreRows. The vertex data is the points C, R0 and R1, and
// whether to use them.
#include "sinew/methods/sdef/sdef.h"

#include <cmath>

#define SINEW_THIS_FILE "sinew/methods/sdef/sdef.cpp"
#include "sinew/lanes/all_targets.h"
#include "sinew/lanes/exponential-inl.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew::HWY_NAMESPACE {
namespace {

/// The two bones of a vertex.
struct Pair {
    std::int32_t bones[2];
    const float* rows[2];
    float sign;                  // with which the second quaternion is added
    float squared_angle = 0.0f;  // between the quaternions; 0 if they are blended by their sum

    HWY_INLINE Pair(const Frame& frame, const std::int32_t* of)
        : bones{of[0], of[1]},
          rows{row_of<CentreRows::kNumbers>(*frame.palette, of[0]),
               row_of<CentreRows::kNumbers>(*frame.palette, of[1])},
          sign(dot(rows[0], rows[1]) < 0.0f ? -1.0f : 1.0f) {
        const bool by_slerp = frame.parameters[0] == 1.0;
        if (!by_slerp) return;
        double difference = 0.0;
        double sum = 0.0;
        for (std::size_t i = 0; i < 4; ++i) {
            const auto first = static_cast<double>(rows[0][i]);
            const auto second = static_cast<double>(sign * rows[1][i]);
            difference += (first - second) * (first - second);
            sum += (first + second) * (first + second);
        }
        const double angle = 2.0 * std::atan2(std::sqrt(difference), std::sqrt(sum));
        squared_angle = static_cast<float>(angle * angle);
    }
};

/// sin(weight * angle), up to a factor common to both weights: rotations are divided by their length.
template <class D>
HWY_INLINE Vec<D> slerp_weight(D d, Vec<D> weight, float squared_angle) {
    const Vec<D> y = hn::Mul(hn::Mul(weight, weight), hn::Set(d, squared_angle));
    return hn::Mul(weight, ExponentialFactors<D>(d, y).sinc);
}

/// The image of `rest` under the pair.
///
/// spheres  the vertex data, kLanes apart, model space
template <bool kSlerp, class D>
HWY_INLINE Points<D> deformed_by(D d, const Palette& palette, const Pair& pair, const Vec<D>* weights,
                                 const Points<D>& rest, const float* spheres, const Spaces& spaces) {
    const auto point_at = [&](std::size_t i) HWY_ATTR {
        return to_bones(d, spaces, load_row_points(d, spheres + 3 * kLanes * i));
    };
    const Points<D> centre = point_at(0);
    const Points<D> first = point_at(1);
    const Points<D> second = point_at(2);
    // Other lanes use the vertex as the centre and R0 = R1, which gives linear blending.
    const auto is_used = hn::Ne(hn::Load(d, spheres + 9 * kLanes), hn::Zero(d));
    const Vec<D> half = hn::IfThenElseZero(is_used, hn::Set(d, 0.5f));
    const Points<D> c{hn::IfThenElse(is_used, centre.x, rest.x), hn::IfThenElse(is_used, centre.y, rest.y),
                      hn::IfThenElse(is_used, centre.z, rest.z)};
    const Points<D> between = times<D>(half, subtract<D>(first, second));
    // The midpoints of the definition: R0 minus the weighted mean of R0 and R1 is the second weight times R0 -
    // R1.
    const Points<D> midpoints[2] = {add_scaled<D>(c, weights[1], between),
                                    add_scaled<D>(c, hn::Neg(weights[0]), between)};
    Points<D> displacement;
    for (std::size_t k = 0; k < 2; ++k) {
        Points<D> moved = sinew::HWY_NAMESPACE::displacement(d, pair.rows[k] + 4, midpoints[k]);
        Points<D> added;
        if (scaled(d, palette, pair.bones[k], rest, added)) moved = add<D>(moved, added);
        displacement = k == 0 ? times<D>(weights[0], moved) : add_scaled<D>(displacement, weights[1], moved);
    }
    const Vec<D> first_share = kSlerp ? slerp_weight(d, weights[0], pair.squared_angle) : weights[0];
    const Vec<D> second_share =
        hn::Mul(hn::Set(d, pair.sign), kSlerp ? slerp_weight(d, weights[1], pair.squared_angle) : weights[1]);
    Vec<D> rotation[4];
    for (std::size_t i = 0; i < 4; ++i) {
        rotation[i] = hn::MulAdd(second_share, hn::Set(d, pair.rows[1][i]),
                                 hn::Mul(first_share, hn::Set(d, pair.rows[0][i])));
    }
    return add<D>(rest, add_rotation(d, displacement, rotation, subtract<D>(rest, c)));
}

template <bool kSlerp, class D>
HWY_INLINE void deform_and_store(D d, const Frame& frame, const MeshPointers& pointers, const Spaces& spaces,
                                 const Pair& pair, std::size_t b, std::size_t lane,
                                 const float* first_weights, const float* second_weights) {
    const Vec<D> weights[2] = {hn::Load(d, first_weights), hn::Load(d, second_weights)};
    const Points<D> points =
        deformed_by<kSlerp>(d, *frame.palette, pair, weights, load_rest(d, pointers, spaces, b, lane),
                            vertex_rows_of<Sdef::info.vertex_floats>(pointers, b, lane), spaces);
    store_in_model(d, pointers, spaces, b, lane, points);
}

/// Deforms blocks [begin, end) with the same two bones.
template <bool kSlerp>
void deform_pairs(const Frame& frame, std::size_t begin, std::size_t end) {
    const Full d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const Pair pair(frame, frame.bones + pointers.blocks[begin].first_bone);
    for (std::size_t b = begin; b < end; ++b) {
        const float* const weights = weights_of(pointers, b);
        const std::size_t lanes = lanes_end(d, pointers.blocks[b]);
        for (std::size_t lane = 0; lane < lanes; lane += hn::Lanes(d)) {
            deform_and_store<kSlerp>(d, frame, pointers, spaces, pair, b, lane,
                                     first_weights_of(frame, b) + lane, weights + lane);
        }
    }
}

/// Deforms those vertices of a block that have two bones, one by one, since each has its own.
template <bool kSlerp>
void deform_pairs_among(const Frame& frame, std::size_t b) {
    const One d;
    const MeshPointers pointers = pointers_of(frame);
    const Spaces spaces = frame.spaces;
    const Block& block = pointers.blocks[b];
    if (block.influences < 2) return;
    for (std::size_t lane = 0; lane < block.vertices; ++lane) {
        const float* const weights = weights_of(pointers, b) + lane;
        const bool has_two = weights[kLanes] > 0.0f && (block.influences == 2 || weights[2 * kLanes] == 0.0f);
        if (!has_two) continue;
        const Pair pair(frame, frame.bones + block.first_bone + block.influences * lane);
        deform_and_store<kSlerp>(d, frame, pointers, spaces, pair, b, lane, weights, weights + kLanes);
    }
}

template <bool kSlerp>
void deform_blocks(const Frame& frame, std::size_t begin, std::size_t end) {
    for_each_set(
        *frame.mesh, begin, end,
        [&](std::size_t b, std::size_t after) HWY_ATTR {
            frame.mesh->blocks[b].influences == 2 ? deform_pairs<kSlerp>(frame, b, after)
                                                  : deform_rigid<LinearRows>(frame, b, after);
        },
        [&](std::size_t b) HWY_ATTR {
            deform_rigid<LinearRows>(frame, b, b + 1);
            deform_pairs_among<kSlerp>(frame, b);
        });
}

}  // namespace

struct SdefKernel : LinearRows, RigidFunctions<Sdef, LinearRows> {
    static void deform(const Frame& frame, std::size_t begin, std::size_t end) {
        if (frame.vertex_data == nullptr) return deform_rigid<LinearRows>(frame, begin, end);
        const bool by_slerp = frame.parameters[0] == 1.0;
        by_slerp ? deform_blocks<true>(frame, begin, end) : deform_blocks<false>(frame, begin, end);
    }
};

}  // namespace sinew::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

SINEW_KERNEL(Sdef, SdefKernel, .pack_vertex_data = VertexNumbers<Sdef::info.vertex_floats>::pack)
