// SPDX-License-Identifier: GPL-3.0-or-later
// Protects what methods compute of a mesh: on threads, at any size, on each instruction set. tests/python has the
// oracles.
#include <algorithm>
#include <cmath>

#include "scene.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif

namespace sinew::test {
namespace {

/// A sheet with four of seven bones for each vertex, more than are solved together.
struct Sheet {
    Scene scene;
    std::vector<std::int32_t> triangles;

    Sheet() {
        constexpr std::int32_t kSide = 20;
        Random random(25);
        for (std::int32_t v = 0; v < kSide * kSide; ++v) {
            const double x = v / kSide;
            const double y = v % kSide;
            scene.add_vertex(Vec3<float>(Vec3<double>(x, y, 0.0) + random.vector(0.3)),
                             random.influences<float>(4, 7));
            if (v / kSide + 1 == kSide || v % kSide + 1 == kSide) continue;
            triangles.insert(triangles.end(), {v, v + kSide, v + kSide + 1, v, v + kSide + 1, v + 1});
        }
    }

    [[nodiscard]] std::vector<Vec3<float>> centres(std::size_t threads = 0) const {
        Job job(threads);
        return centres_of_rotation(scene.data(), triangles, job);
    }
};

TEST(Centres, threads_change_no_bit_and_size_goes_with_the_mesh) {
    const Sheet sheet;
    const auto expected = sheet.centres(1);
    EXPECT_EQ(sheet.centres(5), expected);
    for (const int power : {-20, 20}) {
        Sheet other = sheet;
        for (Vec3<float>& point : other.scene.rest_points) point *= std::ldexp(1.0f, power);
        const auto centres = other.centres();
        for (std::size_t v = 0; v < centres.size(); ++v) {
            ASSERT_LT(glm::length(std::ldexp(1.0f, -power) * centres[v] - expected[v]), 1e-4f) << v;
        }
    }
}

#if SINEW_WITH_DDM
TEST(DirectDeltaMush, a_vertex_without_faces_has_no_extent) {
    // Near the origin, where rounding of the mesh's other coordinates is largest relative to its own.
    const std::vector<Vec3<float>> points{{1e-3f, 2e-3f, 1e-3f}, {3, 0, 5}, {4, 1, 5}, {3, 2, 6}};
    const std::int32_t offsets[] = {0, 2, 4, 6, 8};
    const std::int32_t bones[] = {0, 1, 0, 1, 0, 1, 0, 1};
    const float weights[] = {0.3f, 0.7f, 0.3f, 0.7f, 0.3f, 0.7f, 0.3f, 0.7f};
    const std::int32_t triangle[] = {1, 2, 3};
    Job job;
    const auto rows = direct_delta_mush({points, offsets, bones, weights}, triangle, 0.1, job);
    ASSERT_EQ(rows.size(), 8 * kMomentFloats);
    for (std::size_t row = 0; row < 8; ++row) {
        float largest = 0.0f;
        for (std::size_t n = 6; n < kMomentFloats; ++n) {
            largest = std::max(largest, std::abs(rows[row * kMomentFloats + n]));
        }
        EXPECT_EQ(largest == 0.0f, row < 2) << row;
    }
}

// tests/python/library/methods/test_ddm.py compares the best one with another solver.
TEST(DirectDeltaMush, has_the_same_rows_on_each_instruction_set) {
    const Sheet sheet;
    Job job;
    const auto expected = direct_delta_mush(sheet.scene.data(), sheet.triangles, 3.0, job);
    for (const std::string_view target : simd_targets()) {
        use_simd_target(target);
        const auto rows = direct_delta_mush(sheet.scene.data(), sheet.triangles, 3.0, job);
        ASSERT_EQ(rows.size(), expected.size()) << target;
        float largest = 0.0f;
        for (std::size_t i = 0; i < rows.size(); ++i) {
            largest = std::max(largest, std::abs(rows[i] - expected[i]));
        }
        EXPECT_LT(largest, 1e-6f) << target;
    }
    use_simd_target(simd_targets().front());
}

TEST(DirectDeltaMush, of_a_mesh_without_vertices_has_no_rows) {
    const std::int32_t offsets[] = {0};
    Job job;
    EXPECT_TRUE(direct_delta_mush({{}, offsets, {}, {}}, {}, 0.1, job).empty());
}
#endif

}  // namespace
}  // namespace sinew::test
