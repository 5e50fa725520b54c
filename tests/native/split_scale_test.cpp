// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the split of a bone's motion into a rotation and its scale, by Blender's rules, for every
// degenerate scale.
#include "sinew/transform/split_scale.h"

#include <string>

#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::Random;
using test::rotation_error;
using test::scaling;

Affine<double> tilted_bone() {
    return to_affine(QuatVec<double>{about<double>({1, 2, 3}, 50.0), {0.5, -1.0, 2.0}});
}

/// The bone posed by `motion` after `scale` along its own axes.
Affine<double> posed(const Affine<double>& motion, const Affine<double>& scale,
                     const Affine<double>& rest_bone) {
    return motion * rest_bone * scale * inverse(rest_bone);
}

void expect_good_split(const Affine<double>& motion, const Affine<double>& rest_bone,
                       const std::string& name) {
    const ScaleSplit<double> split = split_scale(motion, rest_bone);
    ASSERT_TRUE(is_finite(split.rigid)) << name;
    ASSERT_TRUE(is_finite(split.scale)) << name;
    EXPECT_LT(rotation_error(split.rigid.linear), 1e-12) << name;
    EXPECT_LT(distance(split.rigid * split.scale, motion), 1e-12) << name;
}

TEST(SplitScale, rigid_stays_rigid_to_the_bit) {
    Random random(1);
    for (int i = 0; i < 50; ++i) {
        const Affine<double> motion = to_affine(random.motion(3.0));
        const ScaleSplit<double> split = split_scale(motion, to_affine(random.motion(3.0)));
        EXPECT_FALSE(split.has_scale);
        EXPECT_EQ(distance(split.rigid, motion), 0.0);
        EXPECT_EQ(distance(split.scale, Affine<double>{}), 0.0);
    }
}

TEST(SplitScale, small_stretch_is_a_scale) {
    const Affine<double> bone = tilted_bone();
    EXPECT_TRUE(split_scale(posed({}, scaling<double>({1.001, 1, 1}), bone), bone).has_scale);
    EXPECT_FALSE(split_scale(posed({}, scaling<double>({1.000001, 1, 1}), bone), bone).has_scale);
}

TEST(SplitScale, parts_multiply_to_the_whole) {
    const Affine<double> bone = tilted_bone();
    const Affine<double> motion = to_affine(QuatVec<double>{about<double>({3, -1, 2}, 130.0), {1, 2, 3}});
    Affine<double> shear;
    shear.linear[0] = {1.0, 0.4, -0.2};
    const std::pair<const char*, Affine<double>> cases[] = {
        {"uniform", scaling<double>({2, 2, 2})},
        {"tiny", scaling<double>({1e-4, 1e-4, 1e-4})},
        {"non-uniform", scaling<double>({0.5, 3, 1})},
        {"mirror x", scaling<double>({-1, 1, 1})},
        {"mirror y", scaling<double>({1, -1, 1})},
        {"mirror z", scaling<double>({1, 1, -1})},
        {"mirror all", scaling<double>({-2, -1, -3})},
        {"180 degrees by signs", scaling<double>({-1, 1, -1})},
        {"sheared", shear},
        {"mirrored shear", shear * scaling<double>({1, 1, -2})},
    };
    for (const auto& [name, scale] : cases) expect_good_split(posed(motion, scale, bone), bone, name);
}

TEST(SplitScale, scale_along_the_axes_is_found_again) {
    const Affine<double> bone = tilted_bone();
    const Affine<double> motion = to_affine(QuatVec<double>{about<double>({3, -1, 2}, 130.0), {1, 2, 3}});
    const Affine<double> scale = scaling<double>({0.5, 3.0, 0.8});
    const ScaleSplit<double> split = split_scale(posed(motion, scale, bone), bone);
    EXPECT_TRUE(split.has_scale);
    EXPECT_LT(distance(split.rigid, motion), 1e-14);
    EXPECT_LT(distance(split.scale, bone * scale * inverse(bone)), 1e-14);
}

TEST(SplitScale, shear_keeps_the_direction_of_y) {
    const Affine<double> bone = tilted_bone();
    Affine<double> shear;
    shear.linear[1] = {0.5, 1.2, -0.3};
    const Affine<double> motion = posed({}, shear, bone);
    const Affine<double> rigid_bone = split_scale(motion, bone).rigid * bone;
    EXPECT_LT(distance(rigid_bone.linear[1], glm::normalize((motion * bone).linear[1])), 1e-14);
}

TEST(SplitScale, zero_axes_give_a_rotation_and_no_nan) {
    const Affine<double> motion = to_affine(QuatVec<double>{about<double>({3, -1, 2}, 130.0), {1, 2, 3}});
    // For bones along the model's axes, one wrong choice of a perpendicular axis is parallel to Y.
    const std::pair<const char*, Affine<double>> bones[] = {
        {"tilted", tilted_bone()},
        {"y along y", {}},
        {"y along z", to_affine(QuatVec<double>{about<double>({1, 0, 0}, 90.0), {1, 0, 0}})},
        {"y along x", to_affine(QuatVec<double>{about<double>({0, 0, 1}, -90.0), {1, 0, 0}})},
        {"y along the diagonal", to_affine(QuatVec<double>{glm::normalize(Quat<double>(1, 1, 0, 1)), {}})},
    };
    for (const auto& [name, bone] : bones) {
        for (int zeros = 1; zeros < 8; ++zeros) {
            const Affine<double> scale =
                scaling<double>({zeros & 1 ? 0.0 : 1.5, zeros & 2 ? 0.0 : 1.5, zeros & 4 ? 0.0 : 1.5});
            const std::string label = std::string(name) + ", zeros " + std::to_string(zeros);
            expect_good_split(posed(motion, scale, bone), bone, label);
            expect_good_split(posed({}, scale, bone), bone, label + ", unmoved");
        }
    }
}

TEST(SplitScale, nothing_left_turns_to_the_axes_of_the_model) {
    const Affine<double> bone = tilted_bone();
    const ScaleSplit<double> split = split_scale(posed({}, scaling<double>({0, 0, 0}), bone), bone);
    EXPECT_LT(distance(split.rigid * bone, Affine<double>{Mat3<double>(1.0), bone.translation}), 1e-14);
}

TEST(SplitScale, collapsed_to_a_line_or_plane_gives_a_rotation) {
    Random random(3);
    for (int i = 0; i < 100; ++i) {
        const Affine<double> bone = to_affine(random.motion(2.0));
        const Vec3<double> along = random.vector(1.0);
        Affine<double> line;
        for (int axis = 0; axis < 3; ++axis) line.linear[axis] = random.uniform(-0.9, 0.9) * along;
        expect_good_split(posed({}, line, bone), bone, "line " + std::to_string(i));
        Affine<double> plane;
        plane.linear[2] = 0.3 * plane.linear[0] + 0.6 * plane.linear[1];
        expect_good_split(posed({}, plane, bone), bone, "plane " + std::to_string(i));
    }
}

TEST(SplitScale, extreme_shear_and_scale_give_a_rotation) {
    Affine<double> diagonal;
    const Vec3<double> along = Vec3<double>(1.0);
    // Both other axes lean towards Y and are long: Blender's rule then uses only Y.
    diagonal.linear =
        Mat3<double>(4.0 * along + Vec3<double>(1, 0, 0), along, 5.0 * along + Vec3<double>(0, 0, 1));
    expect_good_split(diagonal, {}, "diagonal");
    Affine<double> leaning;
    leaning.linear[0] = {1.0, 4.0, 0.0};
    expect_good_split(leaning, {}, "x leans on y");
    leaning.linear[2] = {0.0, 4.0, 1.0};
    expect_good_split(leaning, {}, "x and z lean on y");
}

TEST(SplitScale, float_is_finite_for_every_named_scale) {
    const Affine<float> bone = cast<float>(tilted_bone());
    for (const float size : {0.0f, 1e-30f, 1e-12f, 1e-4f, 1e4f, -1.0f}) {
        for (int axes = 1; axes < 8; ++axes) {
            const Affine<float> scale =
                scaling<float>({axes & 1 ? size : 1.0f, axes & 2 ? size : 1.0f, axes & 4 ? size : 1.0f});
            const ScaleSplit<float> split = split_scale(bone * scale * inverse(bone), bone);
            EXPECT_TRUE(is_finite(split.rigid)) << size << " on " << axes;
            EXPECT_TRUE(is_finite(split.scale)) << size << " on " << axes;
        }
    }
}

}  // namespace
}  // namespace sinew
