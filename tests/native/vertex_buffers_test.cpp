// SPDX-License-Identifier: GPL-3.0-or-later
// Protects what engines call: vertex buffers that hold other data, too, packed influences, a job system of the
// host's, and the header that has all.
#include "sinew/vertex_buffers.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "polygons.h"
#include "scene.h"
#include "sinew/sinew.h"

namespace sinew::test {
namespace {

/// As in a vertex buffer of an engine.
struct Vertex {
    float before = 7.0f;
    Vec3<float> point{};
    Vec3<float> normal{};
    Vec3<float> tangent{};
    float after = 9.0f;
};

class Buffer {
public:
    explicit Buffer(std::size_t count) : vertices_(count) {}
    explicit Buffer(const std::vector<Vec3<float>>& points) : vertices_(points.size()) {
        for (std::size_t i = 0; i < points.size(); ++i) vertices_[i].point = points[i];
    }

    Strided<Vec3<float>> operator[](Vec3<float> Vertex::*member) {
        return {&(vertices_.front().*member), vertices_.size(), sizeof(Vertex)};
    }

    /// What was written, if all else is as before.
    std::vector<Vec3<float>> written(Vec3<float> Vertex::*member) {
        for (const Vertex& vertex : vertices_) {
            EXPECT_EQ(vertex.before, 7.0f);
            EXPECT_EQ(vertex.after, 9.0f);
        }
        return copied((*this)[member]);
    }

private:
    std::vector<Vertex> vertices_;
};

class VertexBuffers : public OnEachTarget {};

INSTANTIATE_TEST_SUITE_P(every, VertexBuffers, testing::ValuesIn(simd_targets()), name_of_target);

TEST_P(VertexBuffers, take_points_of_each_method_and_mix) {
    const Scene scene = scene_of_shared_bones(3);
    const Binding binding(scene.data());
    std::vector<float> shares;
    for (std::size_t i = 0; i < scene.rest_points.size(); ++i)
        shares.push_back(static_cast<float>(i / 40 % 3) / 2.0f);
    for (const MethodInfo& method : kMethods) {
        for (const bool mixes : {false, true}) {
            const auto mix = mixes ? std::optional(MixData{Lbs::info, shares}) : std::nullopt;
            const Deformer deformer(binding, method, mix);
            Buffer buffer(scene.rest_points.size());
            EXPECT_TRUE(deformer.deform(scene.posed_from_rest, {}, buffer[&Vertex::point]));
            EXPECT_TRUE(same_bits(buffer.written(&Vertex::point), deformed(deformer, scene))) << method.name;
        }
    }
}

TEST_P(VertexBuffers, take_normals_and_tangents) {
    const Scene scene = scene_of_shared_bones(4);
    const std::size_t count = scene.rest_points.size();
    std::vector<Vec3<float>> points(count), normals(count), tangents(count);
    std::vector<std::int32_t> reversed(count);
    for (std::size_t i = 0; i < count; ++i) reversed[i] = static_cast<std::int32_t>(count - 1 - i);
    Random random(5);
    std::vector<Vec3<float>> rest;
    for (std::size_t i = 0; i < count; ++i) rest.push_back(Vec3<float>(random.vector(1.0)));
    for (const bool has_vertices : {false, true}) {
        const std::span<const std::int32_t> vertices =
            has_vertices ? std::span<const std::int32_t>(reversed) : std::span<const std::int32_t>();
        const SkinnedNormals skinned(Binding(scene.data()), Dq::info, {rest, scene.rest_points, vertices});
        EXPECT_TRUE(skinned.deform(scene.posed_from_rest, {}, points, normals, tangents));
        Buffer buffer(count);
        EXPECT_TRUE(skinned.deform(scene.posed_from_rest, {}, buffer[&Vertex::point], buffer[&Vertex::normal],
                                   buffer[&Vertex::tangent]));
        EXPECT_TRUE(same_bits(buffer.written(&Vertex::point), points));
        EXPECT_TRUE(same_bits(buffer.written(&Vertex::normal), normals));
        EXPECT_TRUE(same_bits(buffer.written(&Vertex::tangent), tangents));
        Buffer alone(points);
        EXPECT_TRUE(
            skinned.deform_normals(scene.posed_from_rest, {}, alone[&Vertex::point], alone[&Vertex::normal]));
        EXPECT_TRUE(same_bits(alone.written(&Vertex::normal), normals));
    }
}

TEST_P(VertexBuffers, are_changed_by_stages) {
    const Scene scene = scene_of_shared_bones(6);
    const Binding binding(scene.data());
    std::vector<Vec3<float>> points = deformed(Deformer(binding, Dq::info), scene);
    for (Vec3<float>& point : points) point *= 1.3f;
    std::vector<BoneSegment<float>> segments;
    std::vector<TwistBone> twists;
    for (std::int32_t bone = 0; bone < kBones; ++bone) {
        const Vec3<float> head = scene.rest_bones[static_cast<std::size_t>(bone)].translation;
        const Vec3<float> tail = head + Vec3<float>(0.1f, 0.5f, 0.2f);
        segments.push_back({head, tail});
        if (bone % 2 == 0) twists.push_back({bone, bone, bone + 1, false, head, tail});
    }
    const TwistSpread spread(binding, {twists, scene.rest_bones});
    const BulgeLimit limit(binding, {segments});
    Buffer buffer(points);
    EXPECT_TRUE(spread.apply(points, scene.posed_from_rest));
    EXPECT_TRUE(limit.apply(points, scene.posed_from_rest));
    EXPECT_TRUE(spread.apply(buffer[&Vertex::point], scene.posed_from_rest));
    EXPECT_TRUE(limit.apply(buffer[&Vertex::point], scene.posed_from_rest));
    EXPECT_TRUE(same_bits(buffer.written(&Vertex::point), points));

    const Mesh mesh = random_mesh(3, 700);
    const DeltaMush mush({mesh.offsets, mesh.corners, mesh.edges}, mesh.rest_points, {});
    points = mesh.rest_points;
    for (Vec3<float>& point : points) point.x = std::cos(3.0f * point.y);
    Buffer smoothed(points);
    EXPECT_TRUE(mush.apply(points));
    EXPECT_TRUE(mush.apply(smoothed[&Vertex::point]));
    EXPECT_TRUE(same_bits(smoothed.written(&Vertex::point), points));
}

TEST(InfluencesOf, are_those_of_the_buffers) {
    struct Skin {
        std::array<std::uint8_t, 4> joints;
        std::array<std::uint16_t, 4> weights;
    };
    const std::vector<Skin> skins{{{1, 2, 0, 0}, {65535, 0, 0, 0}}, {{3, 255, 4, 0}, {13107, 26214, 0, 0}}};
    const std::vector<std::array<std::uint16_t, 2>> more_joints{{0, 0}, {300, 7}};
    const std::vector<std::array<float, 2>> more_weights{{0.0f, 0.0f}, {0.25f, 0.5f}};
    const InfluenceBuffer<std::uint8_t, std::uint16_t, 4> first{{&skins.front().joints, 2, sizeof(Skin)},
                                                                {&skins.front().weights, 2, sizeof(Skin)}};
    const InfluenceBuffer<std::uint16_t, float, 2> second{more_joints, more_weights};
    const BufferInfluences found = influences_of(first, second);
    EXPECT_EQ(found.offsets, (std::vector<std::int32_t>{0, 1, 5}));
    EXPECT_EQ(found.bones, (std::vector<std::int32_t>{1, 3, 255, 300, 7}));
    EXPECT_EQ(found.weights, (std::vector<float>{1.0f, 0.2f, 0.4f, 0.25f, 0.5f}));
    EXPECT_THROW(static_cast<void>(influences_of(InfluenceBuffer<std::uint16_t, float, 2>{more_joints, {}})),
                 std::invalid_argument);
}

/// A host that runs each job on a thread of its own, and counts them.
class Host {
public:
    Host() { use_job_system({&run, this, 3}); }
    ~Host() { use_job_system({}); }
    std::atomic<std::size_t> jobs{0};

private:
    static void run(void* host, std::size_t jobs, void (*job)(void*, std::size_t), void* of_job) {
        static_cast<Host*>(host)->jobs += jobs;
        std::vector<std::thread> threads;
        for (std::size_t i = 0; i < jobs; ++i) threads.emplace_back(job, of_job, i);
        for (std::thread& thread : threads) thread.join();
    }
};

TEST(JobSystem, does_the_work_of_the_threads) {
    const Scene scene = random_scene(8, 20000, 1.0);
    const Deformer deformer(scene.data(), Dq::info);
    const std::vector<Vec3<float>> alone = deformed(deformer, scene, {.threads = 1});
    {
        Host host;
        EXPECT_EQ(hardware_threads(), 3u);
        EXPECT_TRUE(same_bits(deformed(deformer, scene, {.threads = 3}), alone));
        EXPECT_EQ(host.jobs, 3u);
        std::atomic<std::size_t> sum{0};
        parallel_for(
            1000, 0, [&](std::size_t begin, std::size_t end) { sum += end - begin; }, 10);
        EXPECT_EQ(sum, 1000u);
        const auto fails = [](std::size_t begin, std::size_t) {
            if (begin == 500) throw std::runtime_error("as work may");
        };
        EXPECT_THROW(parallel_for(1000, 3, fails, 10), std::runtime_error);
    }
    EXPECT_TRUE(same_bits(deformed(deformer, scene, {.threads = 2}), alone));
}

}  // namespace
}  // namespace sinew::test
