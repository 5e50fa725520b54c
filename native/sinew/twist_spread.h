// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/binding.h"
#include "sinew/export.h"
#include "sinew/skeleton/pose.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace sinew {

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

/// The stage `twist_spread` (stages/twist_spread/twist_spread.h) for one mesh, applied after Deformer::deform() and
/// before all other stages.
class SINEW_EXPORT TwistSpread {
public:
    /// Shares the memory of `binding`. Throws also for bones beyond rest_bones, a bone that is listed twice, rest bones
    /// without a Y axis, and a singular transform.
    TwistSpread(const Binding& binding, const TwistSpreadData& data);

    /// Sets other rest points [vertices], or the same points with another bones_from_model. The first call
    /// allocates memory for them.
    ///
    /// bones_from_model  invertible
    Status set_rest_points(std::span<const Vec3<float>> rest_points,
                           const Affine<float>& bones_from_model = {}) noexcept;

    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Of rest_bones. Poses have as many, or fewer.
    [[nodiscard]] std::size_t bone_count() const noexcept;
    [[nodiscard]] std::size_t twist_count() const noexcept;

    /// The twist of each tip in a pose, radians [twists], with fades and turns, without amounts.
    [[nodiscard]] std::vector<float> angles(std::span<const Affine<float>> posed_from_rest,
                                            std::span<const TwistChannels<float>> channels = {}) const;

    /// Spreads the twists in place.
    ///
    /// points  [vertices] deformed, model space
    /// pose    only its bones are read: the space is that of the rest points
    ///
    /// Where no bone is twisted, no bit changes.
    Status apply(std::span<Vec3<float>> points, const Pose& pose,
                 const TwistSpreadOptions& options = {}) const noexcept;

private:
    struct State;
    Owned<State> state_;
};

}  // namespace sinew
