// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <string_view>
#include <vector>

#include "sinew/methods/method_info.h"
#include "sinew/stages/stage.h"
#include "sinew/transform/affine.h"
#include "sinew/transform/rotation.h"

namespace sinew {

/// A bone whose vertices share a twist.
struct TwistBone {
    std::int32_t bone;  // its vertices are twisted about the line from head to tail
    std::int32_t base;  // the twist is that of `tip` relative to this bone
    std::int32_t tip;
    bool is_from_parent;  // false: added towards the tail; true: taken back towards the head
    Vec3<float> head;     // at rest, where the share of the twist is 0
    Vec3<float> tail;     // at rest, where it is 1; at the head: the line is along the bone's Y axis
};

/// The rotation channels of a bone: how far they say that it went.
template <class T>
struct TwistChannels {
    Quat<T> rotation;  // relative to rest, on the bone's own rest axes; all 0: unknown
    Vec3<T> angles;    // radians about these axes: Euler angles, or angle times unit axis
};

/// How a method blends rotations that are more than 180 degrees apart. In the order of TwistSpreadDefinition::kBlends.
enum class TwistBlend {
    linear,      // matrices: the stage twists the bone's own matrix
    matrices,    // a rotation made of blended matrices, which goes no way round
    rotations,   // quaternions: the shorter way
    logarithms,  // logarithms: the shorter way, in proportion to the weights
};

/// Twist Spread: spreads the twist of a bone against the next along the bone, as twist bones do.
struct TwistSpreadDefinition {
    static constexpr std::string_view kBlends[] = {"linear", "matrices", "rotations", "logarithms"};
    static constexpr Parameter kParameters[] = {
        {"enabled", "Twist Spread", "Spread twists along bones, as twist bones do", "",
         ParameterKind::boolean, 0.0, 0.0, 1.0},
        {"amount", "Amount", "How much of each twist is spread: 0 nothing, 1 all of it", "factor",
         ParameterKind::number, 1.0, 0.0, 1.0},
        {"turns", "Beyond 180°",
         "Beyond half a turn, go as far as a bone's own Euler angles or axis and angle say, up to two turns",
         "", ParameterKind::boolean, 1.0, 0.0, 1.0},
        {"group", "Vertex Group", "How much each vertex takes part: 0 not at all, 1 fully", "factor",
         ParameterKind::vertex_group},
    };
    static constexpr StageInfo info{
        "twist_spread", "Twist Spread",
        "The twist of a hand goes along the whole forearm instead of collapsing or shearing the wrist",
        "the twist of Jacobson, Sorkine 2011; the fades and turns are Sinew's own", kParameters};

    /// Angles in radians from which a twist fades, to nothing at 180 degrees.
    static constexpr double kFadeStart = 150.0 / 180.0 * std::numbers::pi;
    /// Channels that differ from the pose by the first angle or less are trusted, from the second on they are not.
    static constexpr double kTrusted = 1.0 / 180.0 * std::numbers::pi;
    static constexpr double kNotTrusted = 5.0 / 180.0 * std::numbers::pi;
    static constexpr double kMostTurns = 2.0;
    /// A smaller part of a turn is rounding, and counts as none.
    static constexpr double kNoTwist = 2e-7;

    /// From 1 to 0, smoothly, while `x` goes from `from` to `to`.
    template <class T>
    [[nodiscard]] static T fade(T x, T from, T to) noexcept {
        const T t = std::clamp((x - from) / (to - from), T(0), T(1));
        return T(1) - t * t * (T(3) - T(2) * t);
    }

    /// A twist, in turns.
    template <class T>
    struct Reading {
        T angle;   // to be spread
        T around;  // whole turns by which it is beyond the shorter way
        T share;   // of the twist that fades leave
    };

    /// The twist of a rotation about an axis: of the angles that its matrix allows, the nearest to the one that is
    /// expected. It fades where the next is as near, and where the swing comes near 180 degrees, since either
    /// reading must give the same shape.
    ///
    /// rotation, axis  of length 1
    /// expected        radians
    template <class T>
    [[nodiscard]] static Reading<T> read(const Quat<T>& rotation, const Vec3<T>& axis, T expected) noexcept {
        constexpr T kPi = std::numbers::pi_v<T>;
        const T along = glm::dot(vector_part(rotation), axis);
        const T shorter = std::remainder(T(2) * std::atan2(along, rotation.w), T(2) * kPi);
        const T around = std::round((expected - shorter) / (T(2) * kPi));
        const T angle = shorter + T(2) * kPi * around;
        const T swing = T(2) * std::acos(std::min(T(1), std::hypot(along, rotation.w)));
        const T share =
            fade(std::abs(angle - expected), T(kFadeStart), kPi) * fade(swing, T(kFadeStart), kPi);
        const T turns = std::clamp(angle / (T(2) * kPi), T(-kMostTurns), T(kMostTurns));
        if (!(std::abs(turns * share) > T(kNoTwist))) return {T(0), T(0), T(0)};
        return {share * turns, around, share};
    }

    /// The angle in radians that channels make read() expect: 0 where something else rotates the bone as well.
    ///
    /// rotation  of the bone relative to its parent, in the space of the bones
    /// axes      the bone's rest axes in that space
    /// axis      in that space
    template <class T>
    [[nodiscard]] static T expected(const TwistChannels<T>& channels, const Quat<T>& rotation,
                                    const Quat<T>& axes, const Vec3<T>& axis) noexcept {
        const Quat<T> told = axes * channels.rotation * glm::conjugate(axes);
        const T apart = T(2) * std::acos(std::min(T(1), std::abs(glm::dot(told, rotation))));
        return fade(apart, T(kTrusted), T(kNotTrusted)) *
               glm::dot(channels.angles, rotate(glm::conjugate(axes), axis));
    }

    /// The share of the twist at a rest point: 0 at the head, 1 at the tail.
    ///
    /// curve  -1 to 1: below 0 nearer to the tail, 0 in proportion, above 0 nearer to the head
    template <class T>
    [[nodiscard]] static T share(const Vec3<T>& head, const Vec3<T>& tail, T curve,
                                 const Vec3<T>& rest) noexcept {
        const Vec3<T> along = tail - head;
        const T squared = glm::dot(along, along);
        const T e = squared > T(0) ? std::clamp(glm::dot(rest - head, along) / squared, T(0), T(1)) : T(0);
        return e + curve * e * (T(1) - e);
    }

    /// What a rotation by `turns` about a line adds to a point.
    template <class T>
    [[nodiscard]] static Vec3<T> spun(const Vec3<T>& origin, const Vec3<T>& axis, T turns,
                                      const Vec3<T>& point) noexcept {
        const Vec3<T> arm = point - origin;
        return rotate(quat_from_axis_angle(axis, T(2) * std::numbers::pi_v<T> * turns), arm) - arm;
    }

    /// Whether a method with this blend goes the shorter way round.
    [[nodiscard]] static constexpr bool is_short(TwistBlend blend) noexcept {
        return blend == TwistBlend::rotations || blend == TwistBlend::logarithms;
    }

    /// The turns that shortest-path blending drops where bones are `around` whole turns farther apart. There is nothing
    /// between one way round and the other: the greater part decides.
    ///
    /// below  the weights of the bones beyond the twist, of all weights
    /// part   of the twist that is spread
    template <class T>
    [[nodiscard]] static T missing_turns(TwistBlend blend, T around, T below, T part) noexcept {
        if (!is_short(blend) || !(below > T(0)) || !(below < T(1)) || !(part > T(0.5))) return T(0);
        if (blend == TwistBlend::logarithms) return around * below;
        return around * T(2) * std::atan2(below, T(1) - below) / std::numbers::pi_v<T>;
    }

    /// A bone in one frame.
    template <class T>
    struct Bone {
        Affine<T> motion;      // posed_from_rest
        Vec3<T> origin, axis;  // at rest: a point on the axis, and its direction, of length 1
        Vec3<T> head, tail;    // as in TwistBone
        T curve;
        T angle;   // turns, with all factors but those of the vertex
        T around;  // as in Reading
        T part;    // of the twist that is spread, with these factors
        bool is_from_parent;
        bool is_scaled;  // the motion is not rigid
    };

    /// What twisting by one bone adds to a vertex that a method with this blend made. The parameters are those of
    /// deform_vertex().
    template <class T>
    [[nodiscard]] static Vec3<T> added(const Bone<T>& bone, TwistBlend blend, T weight, T below, T mask,
                                       const Vec3<T>& rest, const Vec3<T>& point) noexcept {
        const T e = share(bone.head, bone.tail, bone.curve, rest);
        const T turns = mask * bone.angle * (bone.is_from_parent ? e - T(1) : e);
        // With the bone's matrix M, linear blending by M R(turns) instead of M.
        const Vec3<T> linear = bone.motion.linear * spun(bone.origin, bone.axis, turns, rest);
        if (blend == TwistBlend::linear) return weight * linear;
        const Vec3<T> posed_axis = bone.motion.linear * bone.axis;
        const T length = glm::length(posed_axis);
        if (!(length > T(0))) return Vec3<T>(T(0));
        // Other blends are rotated about the posed axis.
        const Vec3<T> origin = transform_point(bone.motion, bone.origin);
        const Vec3<T> axis =
            (glm::determinant(bone.motion.linear) < T(0) ? T(-1) : T(1)) / length * posed_axis;
        const T missing = missing_turns(blend, bone.around, below, mask * bone.part);
        const Vec3<T> rotated = spun(origin, axis, weight * turns + missing, point);
        if (!bone.is_scaled) return rotated;
        // A scaled bone keeps its scaled shape: a vertex of this bone alone is moved by M R(turns).
        return rotated + weight * (linear - spun(origin, axis, turns, transform_point(bone.motion, rest)));
    }

    /// The vertex after twisting by one bone. Call per bone, in reverse order of TwistSpreadData::twists.
    /// A point that mixes two methods mixes what the twist adds to the points of each.
    ///
    /// blend, mix_blend  of the first and of the second method
    /// mix     the share of the second, 0 to 1
    /// weight  of the bone
    /// below   the weights of the bones beyond the twist, of all weights
    /// mask    of the vertex, 0 to 1
    template <class T>
    [[nodiscard]] static Vec3<T> deform_vertex(const Bone<T>& bone, TwistBlend blend, TwistBlend mix_blend,
                                               T mix, T weight, T below, T mask, const Vec3<T>& rest,
                                               const Vec3<T>& point) noexcept {
        return point + (T(1) - mix) * added(bone, blend, weight, below, mask, rest, point) +
               mix * added(bone, mix_blend, weight, below, mask, rest, point);
    }
};

/// What a TwistSpread is constructed from besides a Binding.
struct TwistSpreadData {
    std::span<const TwistBone> twists;  // each bone at most once, a bone before those that it carries
    // [bones] at rest, Y along the bone, in the space of posed_from_rest
    std::span<const Affine<float>> rest_bones;
    std::span<const std::int32_t> parents{};  // [bones] of each bone, -1 for none; empty: none has one
    Affine<float> bones_from_model{};         // maps rest points to that space; invertible
    std::span<const float> weights{};  // [vertices] of the vertex group, clamped to 0 to 1; empty: all 1
    std::span<const float> mix{};      // [vertices] those of the stage `mix`; empty: all 0
};

/// How to spread the twists of one frame.
struct TwistSpreadOptions {
    float amount = 1.0f;  // clamped to 0 to 1; NaN: 1
    std::span<const float>
        amounts{};  // [twists] further factors, one for each bone, clamped to 0 to 1; NaN: 1
    std::span<const float> curves{};  // [twists] clamped to -1 to 1; NaN: 0
    // [twists] the channels of each tip; empty: unknown
    std::span<const TwistChannels<float>> channels{};
    TwistBlend blend = TwistBlend::linear;      // of the method that made the points
    TwistBlend mix_blend = TwistBlend::linear;  // of the second, where `mix` is above 0
    std::size_t threads = 0;
};

/// The stage `twist_spread` for one mesh, applied after Deformer::deform() and before all other stages.
class SINEW_EXPORT TwistSpread : public BoneStage {
public:
    /// Shares the memory of `binding`. Throws also for bones beyond rest_bones, a bone that is listed twice, rest bones
    /// without a Y axis, and a singular transform.
    TwistSpread(const Binding& binding, const TwistSpreadData& data);

    [[nodiscard]] std::size_t twist_count() const noexcept;

    /// The twist of each tip in a pose, radians [twists], with fades and turns, without amounts.
    [[nodiscard]] std::vector<float> angles(std::span<const Affine<float>> posed_from_rest,
                                            std::span<const TwistChannels<float>> channels = {}) const;

    /// Spreads the twists in place.
    ///
    /// points           [vertices] deformed, model space
    /// posed_from_rest  [bones] finite
    ///
    /// Where no bone is twisted, no bit changes.
    Status apply(std::span<Vec3<float>> points, std::span<const Affine<float>> posed_from_rest,
                 const TwistSpreadOptions& options = {}) const noexcept;

private:
    struct State;
};

}  // namespace sinew
