// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skeleton/skeleton.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "sinew/skeleton/forward_kinematics.h"
#include "support.h"

namespace sinew {
namespace {

using test::distance;
using test::Random;

// A spine with an arm and a leg, and a second root.
constexpr std::array<std::int32_t, 7> kParents{-1, 0, 1, 1, 0, -1, 5};

Affine<double> as_affine(const Affine<double>& a) { return a; }
Affine<double> as_affine(const QuatVec<double>& a) { return to_affine(a); }
Affine<double> as_affine(const DualQuat<double>& a) { return to_affine(a); }

template <class Transform>
std::vector<Affine<double>> chain(const Transform& root, const std::vector<Transform>& local) {
    const Skeleton skeleton(kParents);
    std::vector<Transform> result(local.size());
    root_relative<Transform>(skeleton, root, local, result);
    std::vector<Affine<double>> affines;
    for (const Transform& transform : result) affines.push_back(as_affine(transform));
    return affines;
}

TEST(ForwardKinematics, equals_the_product_along_the_chain) {
    Random random(1);
    const QuatVec<double> root = random.motion(2.0);
    std::vector<QuatVec<double>> qv;
    std::vector<Affine<double>> affine;
    std::vector<DualQuat<double>> dual;
    for (std::size_t bone = 0; bone < kParents.size(); ++bone) {
        qv.push_back(random.motion(2.0));
        affine.push_back(to_affine(qv.back()));
        dual.push_back(to_dual_quat(qv.back()));
    }
    const Affine<double> r = to_affine(root);
    const std::vector<Affine<double>>& a = affine;
    const std::array<Affine<double>, 7> expected{
        r * a[0],        r * a[0] * a[1], r * a[0] * a[1] * a[2], r * a[0] * a[1] * a[3],
        r * a[0] * a[4], r * a[5],        r * a[5] * a[6]};
    const auto by_affine = chain(r, affine);
    const auto by_qv = chain(root, qv);
    const auto by_dual = chain(to_dual_quat(root), dual);
    for (std::size_t bone = 0; bone < kParents.size(); ++bone) {
        EXPECT_LT(distance(by_affine[bone], expected[bone]), 1e-13) << bone;
        EXPECT_LT(distance(by_qv[bone], expected[bone]), 1e-13) << bone;
        EXPECT_LT(distance(by_dual[bone], expected[bone]), 1e-13) << bone;
    }
}

TEST(ForwardKinematics, works_in_place) {
    Random random(2);
    std::vector<Affine<double>> local;
    for (std::size_t bone = 0; bone < kParents.size(); ++bone) local.push_back(to_affine(random.motion(2.0)));
    const auto expected = chain(Affine<double>{}, local);
    const Skeleton skeleton(kParents);
    root_relative<Affine<double>>(skeleton, {}, local, local);
    for (std::size_t bone = 0; bone < local.size(); ++bone)
        EXPECT_EQ(distance(local[bone], expected[bone]), 0.0);
}

TEST(ForwardKinematics, scale_reaches_the_children) {
    const std::array<std::int32_t, 2> parents{-1, 0};
    const Skeleton skeleton(parents);
    std::vector<Affine<double>> bones{test::scaling<double>({2, 3, 4}), {Mat3<double>(1.0), {1, 1, 1}}};
    root_relative<Affine<double>>(skeleton, {}, bones, bones);
    EXPECT_EQ(distance(bones[1].translation, Vec3<double>(2, 3, 4)), 0.0);
}

TEST(ForwardKinematics, of_one_branch_leaves_the_others) {
    const std::vector<std::int32_t> parents{-1, 0, 1, 0, 3, -1};
    const Skeleton skeleton(parents);
    test::Random random(5);
    std::vector<QuatVec<double>> bones;
    for (std::size_t i = 0; i < parents.size(); ++i) bones.push_back(random.motion(2.0));
    const QuatVec<double> root = random.motion(2.0);
    std::vector<QuatVec<double>> whole(6);
    root_relative<QuatVec<double>>(skeleton, root, bones, whole);
    bones[3] = random.motion(2.0);
    std::vector<QuatVec<double>> wanted(6);
    root_relative<QuatVec<double>>(skeleton, root, bones, wanted);
    // Bones outside the branch are not written, whether right or wrong.
    whole[2].translation = {7, 7, 7};
    wanted[2].translation = {7, 7, 7};
    update_branch<QuatVec<double>>(skeleton, root, bones, 3, whole);
    for (std::size_t i = 0; i < parents.size(); ++i) {
        EXPECT_EQ(test::distance(to_affine(whole[i]), to_affine(wanted[i])), 0.0) << i;
    }
}

TEST(Skeleton, keeps_the_parents) {
    const Skeleton skeleton(kParents);
    EXPECT_EQ(skeleton.bone_count(), kParents.size());
    EXPECT_TRUE(std::equal(kParents.begin(), kParents.end(), skeleton.parents().begin()));
}

TEST(Skeleton, may_be_empty) { EXPECT_EQ(Skeleton(std::span<const std::int32_t>{}).bone_count(), 0u); }

void expect_refused(const std::vector<std::int32_t>& parents, const std::string& message) {
    try {
        const Skeleton skeleton(parents);
        ADD_FAILURE() << "accepted; expected: " << message;
    } catch (const std::invalid_argument& error) {
        EXPECT_EQ(error.what(), message);
    }
}

TEST(Skeleton, refuses_a_parent_that_is_not_before_its_child) {
    const std::string wanted = "parents: expected -1 or the index of an earlier bone, got ";
    expect_refused({0}, wanted + "0 for bone 0");
    expect_refused({-1, 2, 0}, wanted + "2 for bone 1");
    expect_refused({-1, 0, 7}, wanted + "7 for bone 2");
    expect_refused({-1, -2}, wanted + "-2 for bone 1");
}

}  // namespace
}  // namespace sinew
