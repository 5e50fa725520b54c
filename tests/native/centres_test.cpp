// SPDX-License-Identifier: GPL-3.0-or-later
// Protects centres of rotation at any size and the cancelling of their computation on threads, and checks of
// vertex data.
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "scene.h"
#include "sinew/methods/cor/centres_of_rotation.h"

namespace sinew {
namespace {

using test::distance;
using test::Scene;

/// A tube of radius 0.5 along x, from 0 to `bones`, with a bone for each unit of length.
struct Tube {
    Scene scene;
    std::vector<std::int32_t> triangles;

    explicit Tube(int bones, int rings, int around) {
        for (int ring = 0; ring < rings; ++ring) {
            const double along = bones * static_cast<double>(ring) / (rings - 1);
            for (int i = 0; i < around; ++i) {
                const double angle = 2.0 * std::numbers::pi * i / around;
                std::vector<Influence<float>> influences;
                for (int bone = 0; bone < bones; ++bone) {
                    const double away = std::abs(along - bone - 0.5);
                    if (away < 1.0) influences.push_back({bone, static_cast<float>(std::cos(1.5 * away))});
                }
                scene.add_vertex({static_cast<float>(along), static_cast<float>(0.5 * std::cos(angle)),
                                  static_cast<float>(0.5 * std::sin(angle))},
                                 influences);
                if (ring == 0) continue;
                const int next = (i + 1) % around;
                const std::int32_t a = around * ring + i;
                const std::int32_t b = around * ring + next;
                triangles.insert(triangles.end(), {a - around, b - around, b, a - around, b, a});
            }
        }
    }

    std::vector<Vec3<float>> centres() const {
        Job job;
        return centres_of_rotation(scene.data(), triangles, job);
    }
};

TEST(Centres, size_and_origin_go_with_the_mesh) {
    const Tube tube(4, 41, 16);
    const auto expected = tube.centres();
    for (const double size : {1e-6, 1e6}) {
        Tube other = tube;
        for (Vec3<float>& point : other.scene.rest_points) point *= static_cast<float>(size);
        const auto centres = other.centres();
        for (std::size_t vertex = 0; vertex < centres.size(); ++vertex) {
            ASSERT_LT(distance(Vec3<double>(centres[vertex]), size * Vec3<double>(expected[vertex])),
                      1e-5 * size);
        }
    }
}

TEST(VertexData, that_is_missing_is_never_taken_for_linear_blending) {
    Tube tube(2, 5, 4);
    tube.scene.posed_from_rest = {
        Affine<float>{}, cast<float>(to_affine(QuatVec<double>{test::about<double>({0, 0, 1}, 80.0), {}}))};
    BindData bound = tube.scene.data();
    const std::vector<float> values(60);
    const VertexData centres{Cor::info, values};
    bound.vertex_data = std::span(&centres, 1);
    const BoundMesh mesh = Binding(bound).unpack();
    const auto refused = [&](const std::optional<MixData>& mix, const MethodInfo& method) -> std::string {
        try {
            const Deformer deformer(mesh.data(), method, mix);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "nothing thrown";
    };
    const std::string wanted =
        "vertex_data: expected that of cor, or cor by name without data, for linear blending, got none";
    EXPECT_EQ(refused({}, Cor::info), wanted);
    const std::vector<float> weights(20);
    EXPECT_EQ(refused(MixData{Cor::info, weights}, Lbs::info), wanted);
    EXPECT_EQ(refused({}, Lbs::info), "nothing thrown");

    // By name, and also in what a Binding keeps.
    const VertexData linear{Cor::info, {}, true};
    BindData data = mesh.data();
    data.vertex_data = std::span(&linear, 1);
    const BoundMesh kept = Binding(data).unpack();
    ASSERT_EQ(kept.vertex_data.size(), 1u);
    EXPECT_TRUE(kept.vertex_data.front().is_linear);
    const auto linear_points = test::deformed(Deformer(data, Lbs::info), tube.scene);
    const auto furthest = [&](const BindData& from) {
        const auto points = test::deformed(Deformer(from, Cor::info), tube.scene);
        float most = 0.0f;
        for (std::size_t i = 0; i < points.size(); ++i) {
            most = std::max(most, glm::length(points[i] - linear_points[i]));
        }
        return most;
    };
    EXPECT_LT(furthest(data), 1e-5f);
    EXPECT_GT(furthest(bound), 0.1f);
}

}  // namespace
}  // namespace sinew
