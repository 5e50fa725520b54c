// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <span>
#include <vector>

#include "sinew/deform/deformer.h"
#include "sinew/skinning/methods.h"
#include "support.h"

namespace sinew {

// Found by argument: without it GoogleTest names each test by the bytes of its row, addresses included.
inline void PrintTo(const MethodInfo& method, std::ostream* stream) { *stream << method.name; }

namespace test {

/// A mesh and a pose that own what BindData points at.
struct Scene {
    std::vector<Vec3<float>> rest_points;
    std::vector<std::int32_t> offsets{0};
    std::vector<std::int32_t> bones;
    std::vector<float> weights;
    std::vector<Affine<float>> rest_bones;
    std::vector<Affine<float>> posed_from_rest;

    // [vertices][kVertexNumbers] three points, then 1, or 0 of some vertices. A method keeps the first of them.
    std::vector<float> vertex_numbers;

    static constexpr std::size_t kVertexNumbers = 10;

    /// Valid until it is asked for again.
    BindData data() const;

    void add_vertex(const Vec3<float>& rest, const std::vector<Influence<float>>& influences);

    /// Takes the mesh to another space.
    void transform(const Affine<float>& by);

private:
    mutable std::vector<VertexData> vertex_data_;
    mutable std::vector<std::vector<float>> vertex_values_;
};

/// Bones 2, 5, ... are stretched along their own axes, every second of those mirrored; 1 to 8 influences.
Scene random_scene(std::uint32_t seed, std::size_t vertices, double extent);

/// Weights as they are.
std::vector<Influence<float>> influences_of(const Scene& scene, std::size_t vertex);

/// Weights of sum 1, divided in double; T is float or double.
template <class T>
std::vector<Influence<T>> normalised_influences_of(const Scene& scene, std::size_t vertex);

std::vector<Vec3<float>> deformed(const Deformer& deformer, const Scene& scene,
                                  const DeformOptions& options = {});

/// As skinning/ has it in T, weights normalised in double and bones prepared in it.
template <class T>
std::vector<Vec3<T>> by_skinning(const MethodInfo& method, const Scene& scene,
                                 std::span<const double> parameters = {});

inline std::vector<Vec3<double>> in_double(const MethodInfo& method, const Scene& scene,
                                           std::span<const double> parameters = {}) {
    return by_skinning<double>(method, scene, parameters);
}

// kTolerance times the size of the scene: float's 6e-8 after some tens of operations. The translation of a
// dual quaternion is a product of two numbers of that size, so it grows with the size and no faster.
inline constexpr double kTolerance = 2e-6;

}  // namespace test
}  // namespace sinew
