// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and poses for tests of kernels, and the definition of each method in any scalar, their oracle.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sinew/base/simd.h"
#include "sinew/deformer.h"
#include "sinew/methods/methods.h"
#include "support.h"

namespace sinew {

// Found by argument-dependent lookup. Without it GoogleTest names each test by the bytes of its MethodInfo,
// including addresses.
inline void PrintTo(const MethodInfo& method, std::ostream* stream) { *stream << method.name; }

namespace test {

/// Whether tests run many times slower than usual, with a sanitizer or an emulator. Those of minutes are then skipped.
#ifdef SINEW_RUNS_SLOWLY
inline constexpr bool kRunsSlowly = true;
#else
inline constexpr bool kRunsSlowly = false;
#endif

/// A mesh and a pose that own the data that BindData refers to.
struct Scene {
    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
    std::vector<Affine<float>> rest_bones;
    std::vector<Affine<float>> posed_from_rest;
    // Pose::rotations, whose signs definitions take; empty: theirs are free
    std::vector<Quat<float>> rotations;

    // [vertices][kVertexNumbers] three points, then 1, or 0 for some vertices. A method uses the first of these
    // numbers.
    std::vector<float> vertex_numbers;

    static constexpr std::size_t kVertexNumbers = 10;

    /// Valid until the next call.
    BindData data() const;

    void add_vertex(const Vec3<float>& rest, const std::vector<Influence<float>>& influences);

    /// Moves the mesh to another space.
    void transform(const Affine<float>& by);

private:
    mutable std::vector<VertexData> vertex_data_;
    mutable std::vector<std::vector<float>> vertex_values_;
};

/// Bones 2, 5, ... are stretched along their own axes, and every second of those is mirrored; 1 to 8 influences.
Scene random_scene(std::uint32_t seed, std::size_t vertices, double extent);

inline constexpr std::int32_t kBones = 12;

/// Many vertices with the same bones, then some with one to eight bones. Bones as of random_scene().
Scene scene_of_shared_bones(std::uint32_t seed);

/// Its tests run on each instruction set.
class OnEachTarget : public testing::TestWithParam<std::string_view> {
protected:
    OnEachTarget() { use_simd_target(GetParam()); }
    ~OnEachTarget() override { use_simd_target(simd_targets().front()); }
};

inline std::string name_of_target(const testing::TestParamInfo<std::string_view>& info) {
    return std::string(info.param);
}

/// With the given weights.
std::vector<Influence<float>> influences_of(const Scene& scene, std::size_t vertex);

/// With weights normalised to sum 1 in double. T is float or double.
template <class T>
std::vector<Influence<T>> normalised_influences_of(const Scene& scene, std::size_t vertex);

std::vector<Vec3<float>> deformed(const Deformer& deformer, const Scene& scene,
                                  const DeformOptions& options = {},
                                  const Affine<float>& bones_from_model = {},
                                  std::span<const Quat<float>> rotations = {});

/// The result of the method's definition in T, with weights normalised and bones prepared in double.
template <class T>
std::vector<Vec3<T>> by_skinning(const MethodInfo& method, const Scene& scene,
                                 std::span<const double> parameters = {});

inline std::vector<Vec3<double>> in_double(const MethodInfo& method, const Scene& scene,
                                           std::span<const double> parameters = {}) {
    return by_skinning<double>(method, scene, parameters);
}

// kTolerance times the size of the scene: float's 6e-8 after some tens of operations. The translation of a dual
// quaternion is a product of two numbers of that size, so it grows linearly with the size.
inline constexpr double kTolerance = 2e-6;

}  // namespace test
}  // namespace sinew
