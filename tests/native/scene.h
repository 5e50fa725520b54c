// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <ostream>
#include <utility>
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

    BindData data() const {
        vertex_data_.clear();
        vertex_values_.clear();
        for (const MethodInfo& method : kMethods) {
            if (method.vertex_floats == 0) continue;
            std::vector<float>& values = vertex_values_.emplace_back();
            for (std::size_t vertex = 0; vertex < rest_points.size(); ++vertex) {
                if (has_no_weight(vertex) && method.keeps_moments) continue;
                const auto numbers = numbers_of<float>(vertex, method);
                values.insert(values.end(), numbers.begin(), numbers.end());
            }
        }
        for (std::size_t i = 0; const MethodInfo& method : kMethods) {
            if (method.vertex_floats > 0) vertex_data_.push_back({method, vertex_values_[i++]});
        }
        return {rest_points, offsets, bones, weights, rest_bones, vertex_data_};
    }

    template <class T>
    std::vector<T> numbers_of(std::size_t vertex, const MethodInfo& method) const {
        if (method.keeps_moments) return moments_at<T>(vertex);
        const auto first = vertex_numbers.begin() + static_cast<std::ptrdiff_t>(kVertexNumbers * vertex);
        return {first, first + static_cast<std::ptrdiff_t>(method.vertex_floats)};
    }

    void add_vertex(const Vec3<float>& rest, const std::vector<Influence<float>>& influences) {
        rest_points.push_back(rest);
        const float is_used = rest.x < 0.0f && rest.y < 0.0f && rest.z < 0.0f ? 0.0f : 1.0f;
        vertex_numbers.insert(vertex_numbers.end(),
                              {0.5f * rest.y, 0.5f * rest.z, 0.5f * rest.x, 0.5f * rest.z, -0.5f * rest.y,
                               0.25f * rest.x, rest.x, 0.5f * rest.x, -0.5f * rest.y, is_used});
        for (const Influence<float>& influence : influences) {
            bones.push_back(influence.bone);
            weights.push_back(influence.weight);
        }
        offsets.push_back(static_cast<std::int32_t>(bones.size()));
    }

    /// Takes the mesh to another space.
    void transform(const Affine<float>& by) {
        for (std::size_t vertex = 0; vertex < rest_points.size(); ++vertex) {
            rest_points[vertex] = transform_point(by, rest_points[vertex]);
            float* const at = &vertex_numbers[kVertexNumbers * vertex];
            for (std::size_t k = 0; k < 9; k += 3) {
                const Vec3<float> point = transform_point(by, Vec3<float>(at[k], at[k + 1], at[k + 2]));
                for (int i = 0; i < 3; ++i) at[k + static_cast<std::size_t>(i)] = point[i];
            }
        }
    }

private:
    bool has_no_weight(std::size_t vertex) const { return total_weight(vertex) == 0.0; }

    /// The first of a vertex and the one after its last; none where what a scene holds does not fit, as in tests of that.
    std::pair<std::size_t, std::size_t> influences_of(std::size_t vertex) const {
        if (vertex + 1 >= offsets.size()) return {0, 0};
        const std::int32_t begin = offsets[vertex];
        const std::int32_t end = offsets[vertex + 1];
        if (begin < 0 || end < begin) return {0, 0};
        const auto after = static_cast<std::size_t>(end);
        if (after > std::min(bones.size(), weights.size())) return {0, 0};
        return {static_cast<std::size_t>(begin), after};
    }

    double total_weight(std::size_t vertex) const {
        const auto [begin, end] = influences_of(vertex);
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(weights[i]);
        return sum;
    }

    /// Its own weights, as if all of its neighbourhood were at the first of its points: what rotates it best is then the
    /// blended quaternion.
    template <class T>
    std::vector<T> moments_at(std::size_t vertex) const {
        std::map<std::int32_t, double> shares;
        const auto [begin, end] = influences_of(vertex);
        for (std::size_t i = begin; i < end; ++i) {
            shares[bones[i]] += static_cast<double>(weights[i]) / total_weight(vertex);
        }
        std::vector<T> rows;
        const float* const centre = &vertex_numbers[kVertexNumbers * vertex];
        for (const auto& [bone, share] : shares) {
            const auto weight = static_cast<float>(share);
            const float row[] = {static_cast<float>(vertex),
                                 static_cast<float>(bone),
                                 weight,
                                 weight * centre[0],
                                 weight * centre[1],
                                 weight * centre[2],
                                 0,
                                 0,
                                 0,
                                 0,
                                 0,
                                 0};
            rows.insert(rows.end(), std::begin(row), std::end(row));
        }
        return rows;
    }

    mutable std::vector<VertexData> vertex_data_;
    mutable std::vector<std::vector<float>> vertex_values_;
};

/// Bones 2, 5, ... are stretched along their own axes, every second of those mirrored; 1 to 8 influences.
inline Scene random_scene(std::uint32_t seed, std::size_t vertices, double extent) {
    Random random(seed);
    Scene scene;
    constexpr int kBones = 12;
    for (int bone = 0; bone < kBones; ++bone) {
        const Affine<double> rest = to_affine(random.motion(extent));
        Affine<double> motion = to_affine(random.motion(extent));
        if (bone % 3 == 2) {
            const double mirror = bone % 2 == 0 ? 1.0 : -1.0;
            const Affine<double> scale =
                scaling<double>({mirror * random.uniform(0.4, 2.0), random.uniform(0.4, 2.0), 1.0});
            motion = motion * rest * scale * inverse(rest);
        }
        scene.rest_bones.push_back(cast<float>(rest));
        scene.posed_from_rest.push_back(cast<float>(motion));
    }
    for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
        const auto count = static_cast<std::size_t>(1 + random.index(8));
        scene.add_vertex(Vec3<float>(random.vector(extent)), random.influences<float>(count, kBones));
    }
    return scene;
}

inline std::vector<Vec3<float>> deformed(const Deformer& deformer, const Scene& scene,
                                         const DeformOptions& options = {}) {
    std::vector<Vec3<float>> points(deformer.vertex_count(), Vec3<float>(-1e9f));
    deformer.deform(scene.posed_from_rest, options, points);
    return points;
}

/// As skinning/ has it in T, weights normalised in double and bones prepared in it.
template <class T, class Method>
std::vector<Vec3<T>> by_skinning(const Scene& scene, std::span<const double> parameters = {}) {
    std::vector<typename Method::template Bone<T>> palette;
    for (std::size_t bone = 0; bone < scene.posed_from_rest.size(); ++bone) {
        palette.push_back(cast<T>(Method::prepare(cast<double>(scene.posed_from_rest[bone]),
                                                  cast<double>(scene.rest_bones[bone]))));
    }
    std::vector<Vec3<T>> points;
    for (std::size_t vertex = 0; vertex < scene.rest_points.size(); ++vertex) {
        const auto begin = static_cast<std::size_t>(scene.offsets[vertex]);
        const auto end = static_cast<std::size_t>(scene.offsets[vertex + 1]);
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(scene.weights[i]);
        std::vector<Influence<T>> influences;
        for (std::size_t i = begin; i < end; ++i) {
            influences.push_back(
                {scene.bones[i], static_cast<T>(static_cast<double>(scene.weights[i]) / sum)});
        }
        const Vec3<T> rest(scene.rest_points[vertex]);
        if constexpr (!Method::info.parameters.empty()) {
            static_assert(Method::info.vertex_floats > 0);
            const std::vector<T> numbers = scene.numbers_of<T>(vertex, Method::info);
            points.push_back(
                Method::template deform_vertex<T>(palette, influences, rest, numbers, parameters));
        } else if constexpr (Method::info.vertex_floats > 0) {
            const std::vector<T> numbers = scene.numbers_of<T>(vertex, Method::info);
            points.push_back(Method::template deform_vertex<T>(palette, influences, rest, numbers));
        } else {
            points.push_back(Method::template deform_vertex<T>(palette, influences, rest));
        }
    }
    return points;
}

template <class T>
std::vector<Vec3<T>> by_skinning(const MethodInfo& method, const Scene& scene,
                                 std::span<const double> parameters = {}) {
    std::vector<Vec3<T>> points;
    for_each_method([&]<class Method>(Method) {
        if (Method::info == method) points = by_skinning<T, Method>(scene, parameters);
    });
    return points;
}

inline std::vector<Vec3<double>> in_double(const MethodInfo& method, const Scene& scene,
                                           std::span<const double> parameters = {}) {
    return by_skinning<double>(method, scene, parameters);
}

// kTolerance times the size of the scene: float's 6e-8 after some tens of operations. The translation of a
// dual quaternion is a product of two numbers of that size, so it grows with the size and no faster.
inline constexpr double kTolerance = 2e-6;

}  // namespace test
}  // namespace sinew
