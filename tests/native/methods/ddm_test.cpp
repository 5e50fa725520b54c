// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the kernels of ddm on each instruction set against the definition in double.
#if SINEW_WITH_DDM

#include "sinew/methods/ddm/ddm.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <tuple>

#include "scene.h"
#include "sinew/base/simd.h"
#include "sinew/deformer.h"

namespace sinew::test {
namespace {

/// A scene, and the rows of its vertices, whose neighbourhoods have an extent.
struct Bound {
    Scene scene;
    std::vector<float> rows;
    std::vector<std::size_t> starts{0};

    [[nodiscard]] VertexData data() const { return {Ddm::info, rows}; }
};

/// Bones differ by at most 100 degrees. Either each block of 16 vertices has the same bones, or each vertex has
/// its own.
///
/// farthest  distance of the farthest bone
Bound bound_scene(std::uint32_t seed, std::size_t bones, std::size_t of_vertex, bool is_mixed, bool is_scaled,
                  double farthest = 1.0) {
    Random random(seed);
    Bound bound;
    Scene& scene = bound.scene;
    for (std::size_t bone = 0; bone < bones; ++bone) {
        const Quat<double> rotation = about(random.vector(1.0), random.uniform(-50.0, 50.0));
        Affine<double> motion = to_affine(QuatVec<double>{rotation, random.vector(1.0)});
        if (bone == 0) motion.translation *= farthest;
        const auto rest = to_affine(random.motion(1.0));
        if (is_scaled && bone % 2 == 1) {
            motion = motion * rest * scaling<double>({0.7, 1.5, 1.0}) * inverse(rest);
        }
        scene.rest_bones.push_back(cast<float>(rest));
        scene.posed_from_rest.push_back(cast<float>(motion));
    }
    std::vector<Influence<float>> influences;
    for (std::size_t vertex = 0; vertex < 320; ++vertex) {
        if (is_mixed || vertex % 16 == 0) {
            influences = random.influences<float>(of_vertex, static_cast<std::int32_t>(bones));
        }
        scene.add_vertex(Vec3<float>(random.vector(1.0)), influences);
        auto sorted = influences;
        std::ranges::sort(sorted, {}, &Influence<float>::bone);
        const Vec3<double> centre = random.vector(1.0);
        for (const auto& [bone, weight] : sorted) {
            // The far bone has a small weight.
            const float share = bone == 0 ? weight / static_cast<float>(farthest) : weight;
            const Vec3<float> first(static_cast<double>(share) * (centre + random.vector(0.05)));
            bound.rows.insert(bound.rows.end(), {static_cast<float>(vertex), static_cast<float>(bone), share,
                                                 first.x, first.y, first.z, share, 0.8f * share, 0.6f * share,
                                                 0.1f * share, -0.1f * share, 0.05f * share});
        }
        // Normalised to sum 1.
        const std::size_t begin = bound.starts.back();
        double sum = 0.0;
        for (std::size_t i = begin; i < bound.rows.size(); i += kMomentFloats) {
            sum += static_cast<double>(bound.rows[i + 2]);
        }
        for (std::size_t i = begin; i < bound.rows.size(); ++i) {
            if ((i - begin) % kMomentFloats > 1) {
                bound.rows[i] = static_cast<float>(static_cast<double>(bound.rows[i]) / sum);
            }
        }
        bound.starts.push_back(bound.rows.size());
    }
    return bound;
}

double error_of(const Bound& bound, double variant) {
    const Scene& scene = bound.scene;
    BindData data = scene.data();
    const VertexData rows = bound.data();
    data.vertex_data = std::span(&rows, 1);
    const double parameters[] = {variant};
    DeformOptions options;
    options.parameters = parameters;
    const auto points = deformed(Deformer(data, Ddm::info), scene, options);
    std::vector<Ddm::Bone<double>> bones;
    for (std::size_t bone = 0; bone < scene.posed_from_rest.size(); ++bone) {
        bones.push_back(
            Ddm::prepare(cast<double>(scene.posed_from_rest[bone]), cast<double>(scene.rest_bones[bone])));
    }
    std::vector<Vec3<double>> expected;
    for (std::size_t vertex = 0; vertex < points.size(); ++vertex) {
        const auto influences = normalised_influences_of<double>(scene, vertex);
        const std::vector<double> own(
            bound.rows.begin() + static_cast<std::ptrdiff_t>(bound.starts[vertex]),
            bound.rows.begin() + static_cast<std::ptrdiff_t>(bound.starts[vertex + 1]));
        expected.push_back(Ddm::deform_vertex<double>(
            bones, influences, Vec3<double>(scene.rest_points[vertex]), own, parameters));
    }
    return largest_error(points, expected);
}

class DdmKernels : public testing::TestWithParam<std::tuple<std::string_view, double>> {
protected:
    void SetUp() override { use_simd_target(std::get<0>(GetParam())); }
    void TearDown() override { use_simd_target(simd_targets().front()); }
    static double variant() { return std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(every, DdmKernels,
                         testing::Combine(testing::ValuesIn(simd_targets()), testing::Values(0.0, 1.0, 2.0)),
                         [](const auto& info) {
                             return std::string(std::get<0>(info.param)) + "_" +
                                    std::string(
                                        Ddm::kVariants[static_cast<std::size_t>(std::get<1>(info.param))]);
                         });

TEST_P(DdmKernels, agree_with_skinning_in_double) {
    for (const bool is_mixed : {false, true}) {
        for (const bool is_scaled : {false, true}) {
            for (const std::size_t count : {1, 2, 3, 4, 7}) {
                const Bound bound =
                    bound_scene(static_cast<std::uint32_t>(count), 12, count, is_mixed, is_scaled);
                EXPECT_LT(error_of(bound, variant()), 2.0 * kTolerance) << is_mixed << is_scaled << count;
            }
        }
    }
}

TEST_P(DdmKernels, agree_for_more_bones_than_are_prepared) {
    EXPECT_LT(error_of(bound_scene(20, 50, 40, false, false), variant()), 2.0 * kTolerance);
    EXPECT_LT(error_of(bound_scene(21, 50, 40, true, false), variant()), 2.0 * kTolerance);
}

TEST_P(DdmKernels, a_far_bone_of_small_weight_costs_no_digits) {
    EXPECT_LT(error_of(bound_scene(22, 4, 4, false, false, 1e4), variant()), 2e-5);
}

// Such as where envelopes or bendy bones give other weights than those from which the moments were computed.
TEST_P(DdmKernels, take_bones_that_the_moments_alone_name) {
    for (const bool is_mixed : {false, true}) {
        Bound bound = bound_scene(23, 12, 4, is_mixed, true);
        std::ranges::fill(bound.scene.bones, 5);
        EXPECT_LT(error_of(bound, variant()), 2.0 * kTolerance) << is_mixed;
    }
}

TEST(BoneCount, includes_what_vertex_data_names) {
    Scene scene;
    scene.add_vertex({1, 2, 3}, {{0, 1.0f}});
    std::vector<float> rows(3 * kMomentFloats);
    for (std::size_t row = 0; row < 3; ++row) {
        rows[kMomentFloats * row + 1] = std::array{0.0f, 7.0f, 9.0f}[row];
        if (row < 2) rows[kMomentFloats * row + 2] = 0.5f;
    }
    const VertexData of_ddm{Ddm::info, rows};
    BindData data = scene.data();
    EXPECT_EQ(Binding(data).bone_count(), 1);
    data.vertex_data = std::span(&of_ddm, 1);
    // Not the last row's, which is all 0.
    EXPECT_EQ(Binding(data).bone_count(), 8);
}

}  // namespace
}  // namespace sinew::test

#endif
