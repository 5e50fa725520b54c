// SPDX-License-Identifier: GPL-3.0-or-later
// Protects skinned normals on threads, at rest and flattened;
// tests/python/library/normals/test_skinned_normals.py has the oracle.
#include "sinew/skinned_normals.h"

#include "scene.h"

namespace sinew::test {
namespace {

struct Frames {
    std::vector<Vec3<float>> normals;
    std::vector<Vec3<float>> tangents;
    std::vector<std::int32_t> vertices;

    [[nodiscard]] RestFrames rest() const { return {normals, tangents, vertices}; }
};

/// A normal and a perpendicular tangent for each vertex.
Frames random_frames(std::size_t count) {
    Random random(5);
    Frames frames;
    for (std::size_t i = 0; i < count; ++i) {
        const Mat3<double> axes = glm::mat3_cast(random.rotation());
        frames.normals.push_back(Vec3<float>(axes[2]));
        frames.tangents.push_back(Vec3<float>(axes[0]));
    }
    return frames;
}

struct Result {
    std::vector<Vec3<float>> points;
    std::vector<Vec3<float>> normals;
    std::vector<Vec3<float>> tangents;
};

Result deformed(const SkinnedNormals& skinned, const Scene& scene, std::size_t threads = 0) {
    Result result{std::vector<Vec3<float>>(skinned.deformer().vertex_count()),
                  std::vector<Vec3<float>>(skinned.frame_count()),
                  std::vector<Vec3<float>>(skinned.has_tangents() ? skinned.frame_count() : 0)};
    DeformOptions options;
    options.threads = threads;
    EXPECT_EQ(
        skinned.deform({scene.posed_from_rest}, options, result.points, result.normals, result.tangents),
        Status::ok);
    return result;
}

class SkinnedByMethod : public testing::TestWithParam<MethodInfo> {};

INSTANTIATE_TEST_SUITE_P(every, SkinnedByMethod, testing::ValuesIn(kMethods),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_P(SkinnedByMethod, threads_change_no_bit) {
    const Scene scene = random_scene(4, 20000, 1.0);
    const SkinnedNormals skinned(Binding(scene.data()), GetParam(),
                                 random_frames(scene.rest_points.size()).rest());
    const auto expected = deformed(skinned, scene, 1);
    for (const std::size_t threads : {0, 2, 5}) {
        const auto result = deformed(skinned, scene, threads);
        EXPECT_TRUE(same_bits(result.normals, expected.normals));
        EXPECT_TRUE(same_bits(result.tangents, expected.tangents));
        DeformOptions options;
        options.threads = threads;
        std::vector<Vec3<float>> alone(expected.normals.size());
        EXPECT_EQ(skinned.deform_normals({scene.posed_from_rest}, options, expected.points, alone),
                  Status::ok);
        EXPECT_EQ(skinned.deform_normals({scene.posed_from_rest}, options, alone, std::span(alone).first(1)),
                  Status::size);
        EXPECT_TRUE(same_bits(alone, expected.normals));
    }
}

TEST(SkinnedNormals, flattened_to_a_line_are_0) {
    Scene scene;
    scene.add_vertex({1, 2, 3}, {{0, 1.0f}});
    scene.posed_from_rest.resize(1);
    scene.posed_from_rest[0].linear = Mat3<float>(1, 0, 0, 0, 0, 0, 0, 0, 0);
    Frames frames;
    frames.normals = {{0, 0, 1}};
    frames.tangents = {{0, 1, 0}};
    const auto result = deformed(SkinnedNormals(Binding(scene.data()), Lbs::info, frames.rest()), scene);
    EXPECT_EQ(result.normals[0], Vec3<float>(0));
    EXPECT_EQ(result.tangents[0], Vec3<float>(0));
}

}  // namespace
}  // namespace sinew::test
