// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sinew/base/owned.h"
#include "sinew/base/status.h"
#include "sinew/binding.h"
#include "sinew/pose/pose.h"

namespace sinew {

/// How to deform one frame.
struct DeformOptions {
    std::size_t threads = 0;
    /// [at most MethodInfo::parameters] values of the method's parameters, made valid by valid_value(). Missing
    /// ones have their defaults.
    std::span<const double> parameters{};
    /// Those of the method that the stage `mix` adds.
    std::span<const double> mix_parameters{};
};

/// The stage `mix`: a second method, and its share at each vertex. See stages/mix/mix.h.
struct MixData {
    MethodInfo method;
    std::span<const float> weights;  // [vertices] clamped to 0 to 1; not NaN; copied
};

/// A binding and a method, ready to deform any pose. Any number of threads may use one Deformer at once; if more than
/// 16 deform at the same time, some wait. It allocates when more of them than ever before deform at once; where there
/// is no memory for that, they take turns. A child that is forked meanwhile can use it, too, but must set rest points
/// again that were being set.
class SINEW_EXPORT Deformer {
public:
    /// Throws also for a method that is not in the list of methods, and one whose vertex data the binding lacks.
    Deformer(const Binding& binding, const MethodInfo& method, const std::optional<MixData>& mix = {});

    /// Constructs its own binding, which no other deformer shares, with memory for other rest points.
    Deformer(const BindData& data, const MethodInfo& method, const std::optional<MixData>& mix = {});

    [[nodiscard]] const MethodInfo& method() const noexcept;
    /// The method that the stage `mix` adds, or null.
    [[nodiscard]] const MethodInfo* mixed_method() const noexcept;
    [[nodiscard]] std::size_t vertex_count() const noexcept;
    /// Influences of positive weight, once they are normalised.
    [[nodiscard]] std::size_t influence_count() const noexcept;
    /// One more than the highest bone that an influence names, also one of weight 0, or a row of vertex data that is
    /// not all 0.
    [[nodiscard]] std::size_t bone_count() const noexcept;

    /// Its binding, with the current rest points.
    [[nodiscard]] BoundMesh unpack() const;
    /// The weights of the stage `mix` [vertices], clamped; empty without it.
    [[nodiscard]] std::vector<float> mix_weights() const;

    /// Sets the rest points [vertices] of this deformer alone, such as when shape keys change. Each result of a
    /// concurrent deform() has either the old points or the new ones. The first call allocates memory for them.
    Status set_rest_points(std::span<const Vec3<float>> rest_points) noexcept;

    /// Writes the deformed points, model space.
    ///
    /// pose    of at least bone_count() bones
    /// points  [vertices]
    ///
    /// A vertex without influences, or with only weights of 0, stays at rest.
    Status deform(const Pose& pose, const DeformOptions& options,
                  std::span<Vec3<float>> points) const noexcept;

    /// For the library's own files.
    struct State;
    [[nodiscard]] const State& state() const noexcept { return *state_; }

private:
    Owned<State> state_;
};

}  // namespace sinew
