// SPDX-License-Identifier: GPL-3.0-or-later
#define GLM_ENABLE_EXPERIMENTAL
#include "scenes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <random>

#include "sinew/transform/convert.h"

namespace sinew::bench {

void Scene::add_vertex(const glm::vec3& rest, std::size_t count, const std::size_t* of, const float* share) {
    const float sum = std::accumulate(share, share + count, 0.0f);
    glm::u16vec4 padded(of[0]);
    glm::vec4 padded_share(0.0f);
    for (std::size_t k = 0; k < count; ++k) {
        bones.push_back(static_cast<std::int32_t>(of[k]));
        weights.push_back(share[k] / sum);
        if (k < 4) {
            const auto i = static_cast<glm::length_t>(k);
            padded[i] = static_cast<std::uint16_t>(of[k]);
            padded_share[i] = share[k] / sum;
        }
    }
    offsets.push_back(static_cast<std::int32_t>(bones.size()));
    plain.rest_points.push_back(rest);
    plain.bones.push_back(padded);
    plain.weights.push_back(padded_share);
}

void Scene::add_moments() {
    std::map<std::int32_t, float> shares;
    for (std::size_t vertex = 0; vertex < plain.rest_points.size(); ++vertex) {
        shares.clear();
        for (std::int32_t i = offsets[vertex]; i < offsets[vertex + 1]; ++i) {
            shares[bones[static_cast<std::size_t>(i)]] += weights[static_cast<std::size_t>(i)];
        }
        const glm::vec3 rest = 0.98f * plain.rest_points[vertex];
        const auto middle = static_cast<float>(offsets[vertex + 1] - offsets[vertex] - 1) / 2.0f;
        float k = 0.0f;
        float along = 0.0f;
        for (const auto& [bone, share] : shares) along += share * 0.02f * (k++ - middle);
        k = 0.0f;
        for (const auto& [bone, share] : shares) {
            const float z = rest.z + 0.02f * (k++ - middle) - along;
            const float row[] = {static_cast<float>(vertex),
                                 static_cast<float>(bone),
                                 share,
                                 share * rest.x,
                                 share * rest.y,
                                 share * z,
                                 share * 0.02f,
                                 share * 0.02f,
                                 share * 0.05f,
                                 0,
                                 0,
                                 share * -0.01f};
            method_values.insert(method_values.end(), std::begin(row), std::end(row));
        }
    }
}

namespace {

void add_pose(Scene& scene, std::size_t bones) {
    QuatVec<double> bone;
    const Quat<double> bend = glm::angleAxis(0.05, glm::normalize(Vec3<double>(1, 2, 0.5)));
    for (std::size_t b = 0; b < bones; ++b) {
        const Vec3<double> head(0, 0, static_cast<double>(b));
        bone = bone * QuatVec<double>{bend, head - rotate(bend, head)};
        const QuatVec<float> motion = cast<float>(bone);
        const Affine<float> affine = to_affine(motion);
        scene.pose.push_back(affine);
        glm::mat4 matrix(affine.linear);
        matrix[3] = glm::vec4(affine.translation, 1.0f);
        scene.matrices.push_back(matrix);
        scene.dual_quats.emplace_back(motion.rotation, motion.translation);
        scene.rotations.push_back(motion.rotation);
        scene.translations.push_back(motion.translation);
    }
}

}  // namespace

Scene make_scene(const Shape& shape) {
    Scene scene;
    std::mt19937 engine(1);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    add_pose(scene, shape.bones);
    std::vector<std::size_t> order(shape.vertices);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (shape.kind == Kind::shuffled) {
        for (std::size_t i = 0; i < shape.vertices; i += 4096) {
            const auto begin = order.begin() + static_cast<std::ptrdiff_t>(i);
            const std::size_t count = std::min<std::size_t>(4096, shape.vertices - i);
            std::shuffle(begin, begin + static_cast<std::ptrdiff_t>(count), engine);
        }
    }
    std::size_t patch_left = 0;
    std::size_t count = shape.influences;
    std::size_t of[kMaxShapeInfluences] = {};
    float share[kMaxShapeInfluences] = {};
    const auto last_first = static_cast<float>(shape.bones - std::min(shape.bones, count));
    for (const std::size_t i : order) {
        const float along =
            static_cast<float>(i) / static_cast<float>(shape.vertices) * static_cast<float>(shape.bones);
        const float angle = unit(engine) * 6.2831853f;
        if (shape.kind == Kind::character) {
            if (patch_left == 0) {
                // On average 1.85 influences, and 24 vertices in a patch, as in human.blend.
                const float chance = unit(engine);
                count = chance < 0.45f ? 1 : chance < 0.80f ? 2 : chance < 0.95f ? 3 : 4;
                patch_left = 1 + static_cast<std::size_t>(unit(engine) * 46.0f);
                for (std::size_t k = 0; k < 4; ++k) {
                    of[k] = std::min(shape.bones - 1, static_cast<std::size_t>(along) / 4 * 4 + k);
                }
                std::shuffle(of, of + 4, engine);
            }
            --patch_left;
        } else {
            const float before = static_cast<float>((count - 1) / 2);
            const auto first =
                static_cast<std::size_t>(std::clamp(std::floor(along) - before, 0.0f, last_first));
            for (std::size_t k = 0; k < count; ++k) of[k] = first + k;
        }
        for (std::size_t k = 0; k < count; ++k) {
            const float away = static_cast<float>(of[k]) + 0.5f - along;
            share[k] = std::exp(-away * away) + 0.02f + 0.05f * unit(engine);
        }
        scene.add_vertex({std::cos(angle), std::sin(angle), along}, count, of, share);
    }
    scene.points.resize(shape.vertices);
    return scene;
}

std::vector<Variant> variants_of(const MethodInfo& method) {
    if (!method.rows_by_bone) return {};
    // The first parameter is the index of the variant.
    return {{std::string(method.name) + "2", {1.0}}, {std::string(method.name) + "4", {2.0}}};
}

}  // namespace sinew::bench
