// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the definitions of methods where influences, signs and bones are degenerate;
// tests/python/reference.py is the oracle elsewhere.
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "sinew/methods/methods.h"
#include "support.h"

namespace sinew {
namespace {

using test::about;
using test::distance;
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

/// Moments, as methods/ddm/direct_delta_mush.h computes them, of a ball about `centre` with the vertex's weights
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
    if constexpr (Method::info.rows_by_bone) {
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
    if (TypeParam::info.rows_by_bone) GTEST_SKIP() << "moments have weights of sum 1";
    Rig rig = rigid_rig(16);
    for (Affine<double>& bone : rig.posed_from_rest) bone.translation = Vec3<double>(0.0);
    const Bones<TypeParam> bones = prepared<TypeParam>(rig);
    const Vec3<double> rest(0.3, -0.4, 0.5);
    const Vec3<double> result = skinned<TypeParam>(bones, {{0, 1e-9}, {1, 3e-9}, {2, 2e-9}}, rest);
    EXPECT_LT(distance(result, transform_point(rig.posed_from_rest[1], rest)), 1e-13);
    const Vec3<double> first = skinned<TypeParam>(bones, {{2, 0.0}, {1, 0.0}}, rest);
    EXPECT_LT(distance(first, transform_point(rig.posed_from_rest[2], rest)), 1e-13);
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

TEST(Heaviest, is_the_first_of_equals) {
    const std::vector<Influence<double>> influences{{3, 0.1}, {5, 0.4}, {7, 0.4}, {9, 0.1}};
    EXPECT_EQ(heaviest<double>(influences).bone, 5);
}

}  // namespace
}  // namespace sinew
