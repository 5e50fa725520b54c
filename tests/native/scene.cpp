// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace sinew::test {
namespace {

/// The range of a vertex's influences.
std::pair<std::size_t, std::size_t> range_of(const Scene& scene, std::size_t vertex) {
    return {static_cast<std::size_t>(scene.offsets[vertex]),
            static_cast<std::size_t>(scene.offsets[vertex + 1])};
}

double total_weight(const Scene& scene, std::size_t vertex) {
    const auto [begin, end] = range_of(scene, vertex);
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(scene.weights[i]);
    return sum;
}

/// The vertex's own weights, as if all of its neighbourhood were at the first of its points: the rotation that
/// fits best is then the blended quaternion.
template <class T>
std::vector<T> moments_at(const Scene& scene, std::size_t vertex) {
    std::map<std::int32_t, double> shares;
    const auto [begin, end] = range_of(scene, vertex);
    for (std::size_t i = begin; i < end; ++i) {
        shares[scene.bones[i]] += static_cast<double>(scene.weights[i]) / total_weight(scene, vertex);
    }
    std::vector<T> rows;
    const float* const centre = &scene.vertex_numbers[Scene::kVertexNumbers * vertex];
    for (const auto& [bone, share] : shares) {
        const auto weight = static_cast<float>(share);
        float row[12] = {static_cast<float>(vertex), static_cast<float>(bone), weight};
        for (std::size_t k = 0; k < 3; ++k) row[3 + k] = weight * centre[k];
        rows.insert(rows.end(), std::begin(row), std::end(row));
    }
    return rows;
}

/// The vertex data that a method keeps for a vertex.
template <class T>
std::vector<T> numbers_of(const Scene& scene, std::size_t vertex, const MethodInfo& method) {
    if (method.rows_by_bone) return moments_at<T>(scene, vertex);
    const auto first =
        scene.vertex_numbers.begin() + static_cast<std::ptrdiff_t>(Scene::kVertexNumbers * vertex);
    return {first, first + static_cast<std::ptrdiff_t>(method.vertex_floats)};
}

/// Gives a bone the sign of the scene's rotations.
template <class Bone>
void take_sign(Bone& bone, const Quat<float>& rotation) {
    if constexpr (requires { bone.rigid.real; }) {
        if (glm::dot(bone.rigid.real, Quat<double>(rotation)) < 0.0) {
            bone.rigid = {-bone.rigid.real, -bone.rigid.dual};
        }
    } else if constexpr (requires { bone.rigid.rotation; }) {
        if (glm::dot(bone.rigid.rotation, Quat<double>(rotation)) < 0.0) {
            bone.rigid.rotation = -bone.rigid.rotation;
        }
    }
}

template <class T, class Method>
std::vector<Vec3<T>> by_method(const Scene& scene, std::span<const double> parameters) {
    std::vector<typename Method::template Bone<T>> palette;
    for (std::size_t bone = 0; bone < scene.posed_from_rest.size(); ++bone) {
        auto prepared =
            Method::prepare(cast<double>(scene.posed_from_rest[bone]), cast<double>(scene.rest_bones[bone]));
        if (!scene.rotations.empty()) take_sign(prepared, scene.rotations[bone]);
        palette.push_back(cast<T>(prepared));
    }
    std::vector<Vec3<T>> points;
    for (std::size_t vertex = 0; vertex < scene.rest_points.size(); ++vertex) {
        const auto influences = normalised_influences_of<T>(scene, vertex);
        const Vec3<T> rest(scene.rest_points[vertex]);
        if constexpr (Method::info.vertex_floats > 0 && !Method::info.parameters.empty()) {
            const std::vector<T> numbers = numbers_of<T>(scene, vertex, Method::info);
            points.push_back(
                Method::template deform_vertex<T>(palette, influences, rest, numbers, parameters));
        } else if constexpr (Method::info.vertex_floats > 0) {
            const std::vector<T> numbers = numbers_of<T>(scene, vertex, Method::info);
            points.push_back(Method::template deform_vertex<T>(palette, influences, rest, numbers));
        } else if constexpr (!Method::info.parameters.empty()) {
            points.push_back(Method::template deform_vertex<T>(palette, influences, rest, parameters));
        } else {
            points.push_back(Method::template deform_vertex<T>(palette, influences, rest));
        }
    }
    return points;
}

}  // namespace

BindData Scene::data() const {
    vertex_data_.clear();
    vertex_values_.clear();
    for (const MethodInfo& method : kMethods) {
        if (method.vertex_floats == 0) continue;
        std::vector<float>& values = vertex_values_.emplace_back();
        for (std::size_t vertex = 0; vertex < rest_points.size(); ++vertex) {
            if (method.rows_by_bone && total_weight(*this, vertex) == 0.0) continue;
            const auto numbers = numbers_of<float>(*this, vertex, method);
            values.insert(values.end(), numbers.begin(), numbers.end());
        }
    }
    for (std::size_t i = 0; const MethodInfo& method : kMethods) {
        if (method.vertex_floats > 0) vertex_data_.push_back({method, vertex_values_[i++]});
    }
    return {rest_points, offsets, bones, weights, rest_bones, vertex_data_};
}

void Scene::add_vertex(const Vec3<float>& rest, const std::vector<Influence<float>>& influences) {
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

void Scene::transform(const Affine<float>& by) {
    for (std::size_t vertex = 0; vertex < rest_points.size(); ++vertex) {
        rest_points[vertex] = transform_point(by, rest_points[vertex]);
        float* const at = &vertex_numbers[kVertexNumbers * vertex];
        for (std::size_t k = 0; k < 9; k += 3) {
            const Vec3<float> point = transform_point(by, Vec3<float>(at[k], at[k + 1], at[k + 2]));
            for (int i = 0; i < 3; ++i) at[k + static_cast<std::size_t>(i)] = point[i];
        }
    }
}

Scene random_scene(std::uint32_t seed, std::size_t vertices, double extent) {
    Random random(seed);
    Scene scene;
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

Scene scene_of_shared_bones(std::uint32_t seed) {
    Random random(seed);
    Scene scene = random_scene(seed, 0, 1.0);
    for (int i = 0; i < 600; ++i) {
        const auto count = static_cast<std::size_t>(1 + i % 6);
        auto influences = random.influences<float>(count, kBones);
        for (std::size_t k = 0; k < count; ++k) {
            influences[k].bone = (i % 6 + static_cast<std::int32_t>(k)) % kBones;
        }
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
    }
    for (int i = 0; i < 100; ++i) {
        const auto count = static_cast<std::size_t>(1 + random.index(8));
        scene.add_vertex(Vec3<float>(random.vector(1.0)), random.influences<float>(count, kBones));
    }
    return scene;
}

std::vector<Influence<float>> influences_of(const Scene& scene, std::size_t vertex) {
    std::vector<Influence<float>> influences;
    const auto [begin, end] = range_of(scene, vertex);
    for (std::size_t i = begin; i < end; ++i) influences.push_back({scene.bones[i], scene.weights[i]});
    return influences;
}

template <class T>
std::vector<Influence<T>> normalised_influences_of(const Scene& scene, std::size_t vertex) {
    std::vector<Influence<T>> influences;
    const double sum = total_weight(scene, vertex);
    for (const auto& [bone, weight] : influences_of(scene, vertex)) {
        influences.push_back({bone, static_cast<T>(static_cast<double>(weight) / sum)});
    }
    return influences;
}

template std::vector<Influence<float>> normalised_influences_of<float>(const Scene&, std::size_t);
template std::vector<Influence<double>> normalised_influences_of<double>(const Scene&, std::size_t);

std::vector<Vec3<float>> deformed(const Deformer& deformer, const Scene& scene, const DeformOptions& options,
                                  const Affine<float>& bones_from_model,
                                  std::span<const Quat<float>> rotations) {
    std::vector<Vec3<float>> points(deformer.vertex_count(), Vec3<float>(-1e9f));
    EXPECT_EQ(deformer.deform({scene.posed_from_rest, bones_from_model, rotations}, options, points),
              Status::ok);
    return points;
}

template <class T>
std::vector<Vec3<T>> by_skinning(const MethodInfo& method, const Scene& scene,
                                 std::span<const double> parameters) {
    std::vector<Vec3<T>> points;
    for_each_method([&]<class Method>(Method) {
        if (Method::info == method) points = by_method<T, Method>(scene, parameters);
    });
    return points;
}

template std::vector<Vec3<float>> by_skinning<float>(const MethodInfo&, const Scene&,
                                                     std::span<const double>);
template std::vector<Vec3<double>> by_skinning<double>(const MethodInfo&, const Scene&,
                                                       std::span<const double>);

}  // namespace sinew::test
