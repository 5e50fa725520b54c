// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "sinew/skinning/methods.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
using test::is_finite;
using test::Random;
using test::scaling;

struct Rig {
    std::vector<Affine<double>> posed_from_rest;
    std::vector<Affine<double>> rest_bones;
};

Rig rigid_rig(std::uint32_t seed) {
    Random random(seed);
    Rig rig;
    for (int bone = 0; bone < 6; ++bone) {
        rig.posed_from_rest.push_back(to_affine(random.motion(2.0)));
        rig.rest_bones.push_back(to_affine(random.motion(2.0)));
    }
    return rig;
}

/// Bones 1, 3 and 5 are stretched along their own axes; bone 3 is mirrored, too.
Rig scaled_rig(std::uint32_t seed) {
    Rig rig = rigid_rig(seed);
    const Vec3<double> factors[] = {{0.5, 1.5, 1.0}, {-1.0, 1.2, 0.7}, {2.0, 2.0, 2.0}};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t bone = 2 * i + 1;
        const Affine<double>& rest = rig.rest_bones[bone];
        rig.posed_from_rest[bone] = rig.posed_from_rest[bone] * rest * scaling(factors[i]) * inverse(rest);
    }
    return rig;
}

template <class Method>
using Bones = std::vector<typename Method::template Bone<double>>;

template <class Method>
Bones<Method> prepared(const Rig& rig) {
    Bones<Method> bones;
    for (std::size_t bone = 0; bone < rig.posed_from_rest.size(); ++bone) {
        bones.push_back(Method::prepare(rig.posed_from_rest[bone], rig.rest_bones[bone]));
    }
    return bones;
}

/// Moments, as deform/direct_delta_mush.h computes them, of a ball about `centre` with the vertex's weights
/// everywhere.
std::vector<double> moments(const std::vector<Influence<double>>& influences, const Vec3<double>& centre) {
    std::map<std::int32_t, double> weights;
    for (const Influence<double>& influence : influences) weights[influence.bone] += influence.weight;
    std::vector<double> rows;
    for (const auto& [bone, weight] : weights) {
        rows.insert(rows.end(), {0.0, static_cast<double>(bone), weight, weight * centre.x, weight * centre.y,
                                 weight * centre.z, 0.2 * weight, 0.2 * weight, 0.2 * weight, 0.0, 0.0, 0.0});
    }
    return rows;
}

/// centre  vertex data, for methods that keep a point for each vertex
template <class Method>
Vec3<double> skinned(const Bones<Method>& bones, const std::vector<Influence<double>>& influences,
                     const Vec3<double>& rest, const Vec3<double>& centre = Vec3<double>(0.0)) {
    if constexpr (Method::info.keeps_moments) {
        return Method::template deform_vertex<double>(bones, influences, rest,
                                                      std::span<const double>(moments(influences, centre)));
    } else if constexpr (Method::info.vertex_floats > 0) {
        // For Sdef also R0 and R1, at the same point: a vertex of two bones is rotated about it.
        const double numbers[] = {centre.x, centre.y, centre.z, centre.x, centre.y,
                                  centre.z, centre.x, centre.y, centre.z, 1.0};
        return Method::template deform_vertex<double>(
            bones, influences, rest, std::span(numbers).template first<Method::info.vertex_floats>());
    } else {
        return Method::template deform_vertex<double>(bones, influences, rest);
    }
}

template <class Method>
class Skinning : public testing::Test {};

struct MethodNames {
    template <class Method>
    static std::string GetName(int) {
        return std::string(Method::info.name);
    }
};

template <class List>
struct TypesOf;
template <class... Method>
struct TypesOf<std::tuple<Method...>> {
    using All = testing::Types<Method...>;
};

using AllMethods = TypesOf<Methods>::All;
TYPED_TEST_SUITE(Skinning, AllMethods, MethodNames);

TYPED_TEST(Skinning, one_influence_moves_with_its_bone) {
    Random random(1);
    for (const Rig& rig : {rigid_rig(2), scaled_rig(3)}) {
        const Bones<TypeParam> bones = prepared<TypeParam>(rig);
        for (std::int32_t bone = 0; bone < 6; ++bone) {
            const Vec3<double> rest = random.vector(3.0);
            const Vec3<double> expected =
                transform_point(rig.posed_from_rest[static_cast<std::size_t>(bone)], rest);
            EXPECT_LT(distance(skinned<TypeParam>(bones, {{bone, 1.0}}, rest), expected), 1e-13);
        }
    }
}

TYPED_TEST(Skinning, bones_that_move_alike_move_the_vertex_alike) {
    Random random(4);
    for (int i = 0; i < 20; ++i) {
        const Affine<double> motion = to_affine(random.motion(2.0));
        const Rig rig{std::vector<Affine<double>>(6, motion), std::vector<Affine<double>>(6)};
        const Vec3<double> rest = random.vector(3.0);
        const auto influences = random.influences<double>(6, 6);
        EXPECT_LT(distance(skinned<TypeParam>(prepared<TypeParam>(rig), influences, rest),
                           transform_point(motion, rest)),
                  1e-13);
    }
}

TYPED_TEST(Skinning, rest_pose_is_unchanged_to_the_bit) {
    Random random(5);
    const Rig rig{std::vector<Affine<double>>(6), rigid_rig(6).rest_bones};
    const Bones<TypeParam> bones = prepared<TypeParam>(rig);
    for (const double extent : {1e-6, 1.0, 1e6}) {
        for (std::size_t count = 1; count <= 6; ++count) {
            const Vec3<double> rest = random.vector(extent);
            const auto influences = random.influences<double>(count, 6);
            EXPECT_TRUE(test::same_bits(skinned<TypeParam>(bones, influences, rest), rest));
        }
    }
}

TYPED_TEST(Skinning, translations_blend_linearly) {
    Random random(7);
    Rig rig{{}, std::vector<Affine<double>>(6)};
    for (int bone = 0; bone < 6; ++bone) {
        rig.posed_from_rest.push_back({Mat3<double>(1.0), random.vector(2.0)});
    }
    const auto influences = random.influences<double>(4, 6);
    const Vec3<double> rest(0.1, 0.2, 0.3);
    Vec3<double> expected = rest;
    for (const auto& [bone, weight] : influences) {
        expected += weight * rig.posed_from_rest[static_cast<std::size_t>(bone)].translation;
    }
    EXPECT_LT(distance(skinned<TypeParam>(prepared<TypeParam>(rig), influences, rest), expected), 1e-14);
}

TYPED_TEST(Skinning, bones_of_no_weight_change_nothing) {
    Random random(8);
    const Bones<TypeParam> bones = prepared<TypeParam>(scaled_rig(9));
    const Vec3<double> rest = random.vector(2.0);
    const Vec3<double> without = skinned<TypeParam>(bones, {{0, 0.4}, {1, 0.6}}, rest);
    const Vec3<double> with = skinned<TypeParam>(bones, {{0, 0.4}, {3, 0.0}, {1, 0.6}, {5, 0.0}}, rest);
    EXPECT_LT(distance(with, without), 1e-15);
}

// Holds for qv as well: (R, t)(q, v) = (R q, R v + t), and both blends are linear in q and in v. Does not hold
// for log, because the logarithm of a product is not the sum of the logarithms.
TYPED_TEST(Skinning, a_rigid_motion_after_the_pose_commutes_but_for_log) {
    Random random(10);
    for (int i = 0; i < 40; ++i) {
        const Rig rig =
            i % 2 == 0 ? rigid_rig(static_cast<std::uint32_t>(i)) : scaled_rig(static_cast<std::uint32_t>(i));
        const Affine<double> motion = to_affine(random.motion(3.0));
        Rig moved = rig;
        for (Affine<double>& bone : moved.posed_from_rest) bone = motion * bone;
        const Vec3<double> rest = random.vector(2.0);
        const auto influences = random.influences<double>(5, 6);
        const Vec3<double> expected =
            transform_point(motion, skinned<TypeParam>(prepared<TypeParam>(rig), influences, rest));
        const double change =
            distance(skinned<TypeParam>(prepared<TypeParam>(moved), influences, rest), expected);
        if (std::is_same_v<TypeParam, Log>) {
            EXPECT_GT(change, 0.1);
        } else {
            EXPECT_LT(change, 1e-12);
        }
    }
}

/// How far the result moves if rest points, rest bones and bone motions are given in another space.
template <class Method>
double change_by_space(const Rig& rig, const Affine<double>& other_from_space,
                       const std::vector<Influence<double>>& influences, const Vec3<double>& rest) {
    const Affine<double> space_from_other = inverse(other_from_space);
    Rig moved = rig;
    for (Affine<double>& bone : moved.posed_from_rest) bone = other_from_space * bone * space_from_other;
    for (Affine<double>& bone : moved.rest_bones) bone = other_from_space * bone;
    const Vec3<double> in_other_space =
        skinned<Method>(prepared<Method>(moved), influences, transform_point(other_from_space, rest),
                        other_from_space.translation);
    return distance(transform_point(space_from_other, in_other_space),
                    skinned<Method>(prepared<Method>(rig), influences, rest));
}

TYPED_TEST(Skinning, turned_axes_change_nothing) {
    Random random(11);
    for (std::uint32_t i = 0; i < 40; ++i) {
        const Rig rig = i % 2 == 0 ? rigid_rig(i) : scaled_rig(i);
        const Affine<double> rotation{to_mat3(random.rotation()), Vec3<double>(0.0)};
        const Vec3<double> rest = random.vector(2.0);
        EXPECT_LT(change_by_space<TypeParam>(rig, rotation, random.influences<double>(5, 6), rest), 1e-12);
    }
}

TYPED_TEST(Skinning, another_origin_changes_only_qv) {
    Random random(12);
    for (std::uint32_t i = 0; i < 40; ++i) {
        const Rig rig = i % 2 == 0 ? rigid_rig(i) : scaled_rig(i);
        const Affine<double> translation{Mat3<double>(1.0), {30.0, -20.0, 10.0}};
        const Vec3<double> rest = random.vector(2.0);
        const double change =
            change_by_space<TypeParam>(rig, translation, random.influences<double>(5, 6), rest);
        if (std::is_same_v<TypeParam, Qv>) {
            EXPECT_GT(change, 0.1);
        } else {
            EXPECT_LT(change, 1e-12);
        }
    }
}

TYPED_TEST(Skinning, influences_in_another_order_change_nothing_where_turns_are_moderate) {
    Random random(13);
    for (int i = 0; i < 20; ++i) {
        Rig rig{{}, std::vector<Affine<double>>(6)};
        for (int bone = 0; bone < 6; ++bone) {
            const Quat<double> q = about<double>(random.vector(1.0), random.uniform(-80.0, 80.0));
            rig.posed_from_rest.push_back({to_mat3(q), random.vector(2.0)});
        }
        auto influences = random.influences<double>(6, 6);
        const Vec3<double> rest = random.vector(2.0);
        const Bones<TypeParam> bones = prepared<TypeParam>(rig);
        const Vec3<double> expected = skinned<TypeParam>(bones, influences, rest);
        std::reverse(influences.begin(), influences.end());
        EXPECT_LT(distance(skinned<TypeParam>(bones, influences, rest), expected), 1e-13);
    }
}

TYPED_TEST(Skinning, opposite_turns_are_finite) {
    const Vec3<double> rest(0.3, -0.4, 0.5);
    for (const Vec3<double>& axis : {Vec3<double>(1, 0, 0), Vec3<double>(0, 1, 0), Vec3<double>(1, 2, 3)}) {
        for (const double degrees : {179.0, 180.0, 181.0, 360.0}) {
            const Rig rig{{{}, {to_mat3(about<double>(axis, degrees)), {0, 0, 0}}},
                          std::vector<Affine<double>>(2)};
            for (const double weight : {0.25, 0.5, 0.75}) {
                const Vec3<double> result =
                    skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 1.0 - weight}, {1, weight}}, rest);
                ASSERT_TRUE(is_finite(result)) << degrees;
                EXPECT_LE(glm::length(result), glm::length(rest) + 1e-12) << degrees;
            }
        }
    }
}

TYPED_TEST(Skinning, three_half_turns_about_square_axes_are_finite) {
    // The quaternions i, j, k and 1 are orthogonal to each other: every choice of a sign is a tie.
    Rig rig{{{}}, std::vector<Affine<double>>(4)};
    for (int axis = 0; axis < 3; ++axis) {
        Vec3<double> direction(0.0);
        direction[axis] = 1.0;
        rig.posed_from_rest.push_back({to_mat3(about<double>(direction, 180.0)), direction});
    }
    const Vec3<double> result =
        skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 0.25}, {1, 0.25}, {2, 0.25}, {3, 0.25}}, {1, 2, 3});
    EXPECT_TRUE(is_finite(result));
}

template <class Method>
class RigidSkinning : public testing::Test {};

/// The methods that blend rotations. They need rest bones if bones are scaled.
template <class List, class... Rigid>
struct RigidOf;
template <class... Rigid>
struct RigidOf<std::tuple<>, Rigid...> {
    using Types = testing::Types<Rigid...>;
};
template <class Method, class... Others, class... Rigid>
struct RigidOf<std::tuple<Method, Others...>, Rigid...>
    : std::conditional_t<has(Method::info.needs, Needs::rest_bones),
                         RigidOf<std::tuple<Others...>, Rigid..., Method>,
                         RigidOf<std::tuple<Others...>, Rigid...>> {};

using RigidMethods = RigidOf<Methods>::Types;
TYPED_TEST_SUITE(RigidSkinning, RigidMethods, MethodNames);

void flip(Quat<double>& q) { q = -q; }
void flip(QuatVec<double>& a) { flip(a.rotation); }
void flip(DualQuat<double>& a) {
    flip(a.real);
    flip(a.dual);
}

TYPED_TEST(RigidSkinning, signs_of_quaternions_change_nothing) {
    Random random(14);
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        const Rig rig = seed % 2 == 0 ? rigid_rig(seed) : scaled_rig(seed);
        const Vec3<double> rest = random.vector(2.0);
        const auto influences = random.influences<double>(6, 6);
        const Vec3<double> expected = skinned<TypeParam>(prepared<TypeParam>(rig), influences, rest);
        for (std::size_t signs = 1; signs < 64; ++signs) {
            Bones<TypeParam> bones = prepared<TypeParam>(rig);
            for (std::size_t bone = 0; bone < 6; ++bone) {
                if ((signs >> bone & 1) != 0) flip(bones[bone].rigid);
            }
            ASSERT_LT(distance(skinned<TypeParam>(bones, influences, rest), expected), 1e-13) << signs;
        }
    }
}

TYPED_TEST(RigidSkinning, antipodal_quaternions_do_not_cancel) {
    Bones<TypeParam> bones = prepared<TypeParam>(rigid_rig(15));
    bones[1] = bones[0];
    flip(bones[1].rigid);
    const Vec3<double> rest(0.3, -0.4, 0.5);
    const Vec3<double> expected = skinned<TypeParam>(bones, {{0, 1.0}}, rest);
    EXPECT_LT(distance(skinned<TypeParam>(bones, {{0, 0.5}, {1, 0.5}}, rest), expected), 1e-14);
}

// A term is never in the hemisphere opposite to the sum, so weights with sum 1 can not cancel; a sum below
// kDegenerateBlend only results from weights that vanish.
TYPED_TEST(RigidSkinning, a_vanishing_blend_turns_with_the_heaviest) {
    if (std::is_same_v<TypeParam, Log>) GTEST_SKIP() << "logarithms that vanish are those of the identity";
    if (std::is_same_v<TypeParam, Sdef>) GTEST_SKIP() << "vertices of three bones are blended linearly";
    if (TypeParam::info.keeps_moments) GTEST_SKIP() << "moments have weights of sum 1";
    Rig rig = rigid_rig(16);
    for (Affine<double>& bone : rig.posed_from_rest) bone.translation = Vec3<double>(0.0);
    const Bones<TypeParam> bones = prepared<TypeParam>(rig);
    const Vec3<double> rest(0.3, -0.4, 0.5);
    const Vec3<double> result = skinned<TypeParam>(bones, {{0, 1e-9}, {1, 3e-9}, {2, 2e-9}}, rest);
    EXPECT_LT(distance(result, transform_point(rig.posed_from_rest[1], rest)), 1e-13);
    const Vec3<double> first = skinned<TypeParam>(bones, {{2, 0.0}, {1, 0.0}}, rest);
    EXPECT_LT(distance(first, transform_point(rig.posed_from_rest[2], rest)), 1e-13);
}

TYPED_TEST(RigidSkinning, twists_keep_the_distance_from_their_axis) {
    const Rig rig{{{}, {to_mat3(about<double>({1, 0, 0}, 170.0)), {0, 0, 0}}},
                  std::vector<Affine<double>>(2)};
    const Vec3<double> rest(2.0, 0.6, 0.8);
    for (const double weight : {0.1, 0.3, 0.5, 0.9}) {
        const Vec3<double> result =
            skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 1.0 - weight}, {1, weight}}, rest);
        EXPECT_NEAR(result.x, 2.0, 1e-14);
        EXPECT_NEAR(std::hypot(result.y, result.z), 1.0, 1e-14);
    }
}

TYPED_TEST(RigidSkinning, half_of_a_right_angle_is_45_degrees) {
    const Rig rig{{{}, {to_mat3(about<double>({0, 0, 1}, 90.0)), {0, 0, 0}}}, std::vector<Affine<double>>(2)};
    const Vec3<double> result = skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 0.5}, {1, 0.5}}, {1, 0, 0});
    EXPECT_LT(distance(result, Vec3<double>(std::sqrt(0.5), std::sqrt(0.5), 0.0)), 1e-15);
}

TYPED_TEST(RigidSkinning, a_bone_scaled_to_nothing_pulls_to_its_head) {
    Rig rig = rigid_rig(17);
    const Affine<double> rest_bone = rig.rest_bones[0];
    rig.posed_from_rest[0] = rest_bone * scaling<double>({0, 0, 0}) * inverse(rest_bone);
    const Vec3<double> rest(0.3, -0.4, 0.5);
    EXPECT_LT(distance(skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 1.0}}, rest), rest_bone.translation),
              1e-14);
    EXPECT_TRUE(is_finite(skinned<TypeParam>(prepared<TypeParam>(rig), {{0, 0.5}, {1, 0.5}}, rest)));
}

// Rest axes of Blender's bones near -Y are not quite orthonormal. Blender's own method misses by as much.
TYPED_TEST(RigidSkinning, a_scaled_bone_whose_rest_axes_lean_takes_its_vertices_along_but_for_dq) {
    Random random(18);
    Rig rig = scaled_rig(19);
    for (Affine<double>& rest_bone : rig.rest_bones) rest_bone.linear[0] += 3e-5 * rest_bone.linear[1];
    const Bones<TypeParam> bones = prepared<TypeParam>(rig);
    double worst = 0.0;
    for (std::int32_t bone = 0; bone < 6; ++bone) {
        const Vec3<double> rest = random.vector(3.0);
        const Vec3<double> expected =
            transform_point(rig.posed_from_rest[static_cast<std::size_t>(bone)], rest);
        worst = std::max(worst, distance(skinned<TypeParam>(bones, {{bone, 1.0}}, rest), expected));
    }
    if (std::is_same_v<TypeParam, Dq>) {
        EXPECT_GT(worst, 1e-6);
    } else {
        EXPECT_LT(worst, 1e-13);
    }
}

TEST(Lbs, is_the_weighted_mean_of_where_bones_put_the_vertex) {
    Random random(18);
    const Rig rig = scaled_rig(19);
    for (int i = 0; i < 20; ++i) {
        const auto influences = random.influences<double>(5, 6);
        const Vec3<double> rest = random.vector(2.0);
        Vec3<double> expected(0.0);
        for (const auto& [bone, weight] : influences) {
            expected += weight * transform_point(rig.posed_from_rest[static_cast<std::size_t>(bone)], rest);
        }
        EXPECT_LT(distance(skinned<Lbs>(prepared<Lbs>(rig), influences, rest), expected), 1e-14);
    }
}

TEST(Lbs, a_half_turn_collapses_to_the_axis) {
    const Rig rig{{{}, {to_mat3(about<double>({1, 0, 0}, 180.0)), {0, 0, 0}}},
                  std::vector<Affine<double>>(2)};
    const Vec3<double> result = skinned<Lbs>(prepared<Lbs>(rig), {{0, 0.5}, {1, 0.5}}, {2.0, 0.6, 0.8});
    EXPECT_LT(distance(result, Vec3<double>(2, 0, 0)), 1e-15);
}

TEST(Dq, rigid_bones_keep_distances_of_vertices_with_the_same_weights) {
    Random random(20);
    const Bones<Dq> bones = prepared<Dq>(rigid_rig(21));
    for (int i = 0; i < 20; ++i) {
        const auto influences = random.influences<double>(6, 6);
        const Vec3<double> a = random.vector(2.0);
        const Vec3<double> b = random.vector(2.0);
        EXPECT_NEAR(distance(skinned<Dq>(bones, influences, a), skinned<Dq>(bones, influences, b)),
                    distance(a, b), 1e-13);
    }
}

TEST(Log, is_half_of_a_screw_at_half_the_weight) {
    // From the identity the blend is the motion itself, at constant speed.
    const Quat<double> rotation = about<double>({0, 0, 1}, 90.0);
    const Vec3<double> centre(1, 0, 0);
    const Affine<double> screw{to_mat3(rotation), centre - rotate(rotation, centre) + Vec3<double>(0, 0, 2)};
    const Rig rig{{{}, screw}, std::vector<Affine<double>>(2)};
    for (const double weight : {0.25, 0.5, 0.75}) {
        const Quat<double> part = about<double>({0, 0, 1}, 90.0 * weight);
        const Vec3<double> rest(0.3, -0.4, 0.5);
        const Vec3<double> expected = centre + rotate(part, rest - centre) + Vec3<double>(0, 0, 2 * weight);
        const Vec3<double> result = skinned<Log>(prepared<Log>(rig), {{0, 1.0 - weight}, {1, weight}}, rest);
        EXPECT_LT(distance(result, expected), 1e-14);
    }
}

TEST(Log, jumps_where_a_bone_passes_180_degrees) {
    const auto at = [](double degrees, double weight) {
        const Rig rig{{{}, {to_mat3(about<double>({1, 0, 0}, degrees)), {0, 0, 0}}},
                      std::vector<Affine<double>>(2)};
        return skinned<Log>(prepared<Log>(rig), {{0, 1.0 - weight}, {1, weight}}, {0.0, 1.0, 0.0});
    };
    EXPECT_LT(distance(at(179.999, 0.5), {0, 0, 1}), 1e-4);
    EXPECT_LT(distance(at(180.001, 0.5), {0, 0, -1}), 1e-4);
    EXPECT_LT(distance(at(179.999, 1.0), at(180.001, 1.0)), 1e-4);
}

/// Bones that rotate arbitrarily about one point each, which adjacent bones have in common.
Rig chain(std::uint32_t seed) {
    Random random(seed);
    Rig rig;
    Affine<double> motion = to_affine(random.motion(2.0));
    for (int bone = 0; bone < 6; ++bone) {
        const Vec3<double> joint = random.vector(2.0);
        const Quat<double> turn = about<double>(random.vector(1.0), random.uniform(-170.0, 170.0));
        if (bone > 0) motion = motion * Affine<double>{to_mat3(turn), joint - rotate(turn, joint)};
        rig.posed_from_rest.push_back(motion);
        rig.rest_bones.push_back({to_mat3(random.rotation()), joint});
    }
    return rig;
}

TEST(Sbs, is_dq_for_two_bones_that_share_a_joint) {
    Random random(30);
    for (std::uint32_t seed = 0; seed < 50; ++seed) {
        const Rig rig = chain(seed);
        for (std::int32_t bone = 0; bone < 5; ++bone) {
            const double weight = random.uniform(0.0, 1.0);
            const std::vector<Influence<double>> influences{{bone, weight}, {bone + 1, 1.0 - weight}};
            const Vec3<double> rest = random.vector(3.0);
            EXPECT_LT(distance(skinned<Sbs>(prepared<Sbs>(rig), influences, rest),
                               skinned<Dq>(prepared<Dq>(rig), influences, rest)),
                      1e-11);
        }
    }
}

TEST(Sbs, the_joint_of_three_bones_is_their_centre) {
    Random random(31);
    const Vec3<double> joint(0.5, -1.0, 2.0);
    const Vec3<double> moved(3.0, 2.0, 1.0);
    Bones<Sbs> bones;
    for (int bone = 0; bone < 3; ++bone) {
        const Quat<double> q = random.rotation();
        bones.push_back(Sbs::prepare(Affine<double>{to_mat3(q), moved - rotate(q, joint)},
                                     Affine<double>{Mat3<double>(1.0), random.vector(5.0)}));
    }
    const auto centre = Sbs::rotation_centre(3, [&](std::size_t i) { return bones[i]; });
    EXPECT_LT(distance(centre, joint), 1e-12);
}

TEST(Sbs, bones_that_rotate_alike_have_the_mean_of_their_heads) {
    const Quat<double> q = about<double>({1, 2, 3}, 50.0);
    Bones<Sbs> bones;
    for (const double along : {1.0, 2.0, 6.0}) {
        bones.push_back(Sbs::prepare(Affine<double>{to_mat3(q), {along, 0, 7}},
                                     Affine<double>{Mat3<double>(1.0), {along, 0, 0}}));
    }
    for (const std::size_t count : {2, 3}) {
        const auto centre = Sbs::rotation_centre(count, [&](std::size_t i) { return bones[i]; });
        EXPECT_LT(distance(centre, {count == 2 ? 1.5 : 3.0, 0, 0}), 1e-15);
    }
}

// Rotations about one axis: the centre is free along it, and stays as near to the heads as possible.
TEST(Sbs, hinges_keep_the_free_direction) {
    for (const std::size_t count : {2, 3, 4}) {
        Bones<Sbs> bones;
        for (std::size_t i = 0; i < count; ++i) {
            const Quat<double> q = about<double>({0, 0, 1}, 35.0 * static_cast<double>(i));
            const Vec3<double> joint(1, 2, 0);
            bones.push_back(Sbs::prepare(Affine<double>{to_mat3(q), joint - rotate(q, joint)},
                                         Affine<double>{Mat3<double>(1.0), {0, 0, 4}}));
        }
        const auto centre = Sbs::rotation_centre(count, [&](std::size_t i) { return bones[i]; });
        EXPECT_LT(distance(centre, {1, 2, 4}), 1e-13) << count;
    }
}

TEST(Cor, about_any_centre_rotates_as_the_blend) {
    Random random(32);
    const Rig rig = rigid_rig(33);
    const Bones<Cor> bones = prepared<Cor>(rig);
    for (int i = 0; i < 20; ++i) {
        const auto influences = random.influences<double>(4, 6);
        const Vec3<double> centre = random.vector(2.0);
        const Vec3<double> rest = random.vector(2.0);
        // The centre moves linearly, and distances from it are preserved.
        const Vec3<double> moved = skinned<Cor>(bones, influences, centre, centre);
        EXPECT_LT(distance(moved, skinned<Lbs>(prepared<Lbs>(rig), influences, centre)), 1e-14);
        EXPECT_NEAR(distance(skinned<Cor>(bones, influences, rest, centre), moved), distance(rest, centre),
                    1e-14);
    }
}

TEST(Cor, without_a_centre_is_linear_blending) {
    const Rig rig = rigid_rig(34);
    const std::vector<Influence<double>> influences{{0, 0.3}, {1, 0.5}, {4, 0.2}};
    const Bones<Cor> bones = prepared<Cor>(rig);
    const Vec3<double> rest(1, -2, 0.5);
    EXPECT_LT(distance(Cor::deform_vertex<double>(bones, influences, rest),
                       skinned<Lbs>(prepared<Lbs>(rig), influences, rest)),
              1e-14);
}

TEST(IterativeDq, is_where_the_logarithms_cancel) {
    Random random(35);
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
        const Rig rig = rigid_rig(seed);
        const Bones<IterativeDq> bones = prepared<IterativeDq>(rig);
        const auto influences = random.influences<double>(6, 6);
        // The motion, from the images of four points.
        const Vec3<double> origin = skinned<IterativeDq>(bones, influences, {0, 0, 0});
        Affine<double> blend{Mat3<double>(0.0), origin};
        for (int axis = 0; axis < 3; ++axis) {
            Vec3<double> unit(0.0);
            unit[axis] = 1.0;
            blend.linear[axis] = skinned<IterativeDq>(bones, influences, unit) - origin;
        }
        EXPECT_LT(test::rotation_error(blend.linear), 1e-13);
        Twist<double> sum;
        for (const auto& [bone, weight] : influences) {
            const Affine<double> difference =
                inverse(blend) * rig.posed_from_rest[static_cast<std::size_t>(bone)];
            sum = sum + weight * to_twist(to_quat_vec(difference));
        }
        EXPECT_LT(glm::length(sum.angular) + glm::length(sum.linear), 1e-6) << seed;
    }
}

TEST(IterativeDq, spreads_a_twist_of_two_bones_evenly) {
    const Rig rig{{{}, {to_mat3(about<double>({1, 0, 0}, 170.0)), {0, 0, 0}}},
                  std::vector<Affine<double>>(2)};
    for (const double weight : {0.1, 0.3, 0.5, 0.9}) {
        const Vec3<double> result = skinned<IterativeDq>(prepared<IterativeDq>(rig),
                                                         {{0, 1.0 - weight}, {1, weight}}, {2.0, 1.0, 0.0});
        EXPECT_LT(distance(result, rotate(about<double>({1, 0, 0}, 170.0 * weight), {2.0, 1.0, 0.0})), 1e-13);
    }
}

TEST(Heaviest, is_the_first_of_equals) {
    const std::vector<Influence<double>> influences{{3, 0.1}, {5, 0.4}, {7, 0.4}, {9, 0.1}};
    EXPECT_EQ(heaviest<double>(influences).bone, 5);
}

}  // namespace
}  // namespace sinew
