// SPDX-License-Identifier: GPL-3.0-or-later
// Protects frames from allocations and locks: they are counted, in a program of its own, as that counts everything
// in the process.
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "polygons.h"
#include "scene.h"
#include "sinew/delta_mush.h"
#include "sinew/ik/solver.h"
#include "sinew/normals.h"
#include "sinew/skinned_normals.h"

#ifdef __GLIBC__
#include <dlfcn.h>
#include <pthread.h>
#endif
#ifdef _WIN32
#include <malloc.h>
#endif

namespace {

std::atomic<int> allocations{0};
std::atomic<int> locks{0};
std::atomic<std::size_t> bytes{0};

// Windows has other functions for aligned memory, with their own deallocation function.
void* allocate_aligned(std::size_t unit, std::size_t size) {
#ifdef _WIN32
    return _aligned_malloc(size, unit);
#else
    return std::aligned_alloc(unit, (size + unit - 1) / unit * unit);
#endif
}

void free_aligned(void* memory) {
#ifdef _WIN32
    _aligned_free(memory);
#else
    std::free(memory);
#endif
}

}  // namespace

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    allocations.fetch_add(1);
    bytes.fetch_add(size);
    return std::malloc(std::max<std::size_t>(size, 1));
}

void* operator new(std::size_t size) {
    if (void* const memory = operator new(size, std::nothrow)) return memory;
    throw std::bad_alloc();
}

void* operator new(std::size_t size, std::align_val_t alignment) {
    allocations.fetch_add(1);
    const auto unit = static_cast<std::size_t>(alignment);
    if (void* const memory = allocate_aligned(unit, size)) return memory;
    throw std::bad_alloc();
}

void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return operator new(size, alignment); }

void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { free_aligned(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { free_aligned(memory); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { free_aligned(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { free_aligned(memory); }

// The thread sanitizer defines its own.
#if defined(__GLIBC__) && !defined(__SANITIZE_THREAD__)
#define SINEW_COUNTS_LOCKS
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) {
    using Lock = int (*)(pthread_mutex_t*);
    static std::atomic<Lock> lock{nullptr};
    if (lock.load() == nullptr) lock.store(reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock")));
    locks.fetch_add(1);
    return lock.load()(mutex);
}
#endif

namespace sinew {
namespace {

using test::about;
using test::random_scene;
using test::Scene;

TEST(Counting, sees_what_there_is) {
    const int before = allocations;
    const auto number = std::make_unique<int>(1);
    EXPECT_EQ(allocations, before + *number);
#ifdef SINEW_COUNTS_LOCKS
    const int locks_before = locks;
    static std::mutex mutex;
    const std::lock_guard guard(mutex);
    EXPECT_EQ(locks, locks_before + 1);
#endif
}

// From the first frame on, and on threads that were not started by the library.
TEST(Frames, allocate_nothing_and_lock_nothing) {
    // Sets of all sizes, some scaled bones, and more blocks than one chunk of a thread's work.
    Scene scene = random_scene(1, 20000, 1.0);
    const Affine<float> bones_from_model{to_mat3(about<float>({1, 2, 3}, 40.0f)), {1, -2, 3}};
    std::vector<Deformer> deformers;
    for (const MethodInfo& method : kMethods) deformers.emplace_back(scene.data(), method);
    std::vector<float> shares(scene.rest_points.size());
    for (std::size_t i = 0; i < shares.size(); ++i) shares[i] = static_cast<float>(i % 100) / 50.0f - 0.5f;
    deformers.emplace_back(scene.data(), Lbs::info, MixData{Dq::info, shares});
    std::vector<Vec3<float>> other_rest_points = scene.rest_points;
    const auto frames = [&](std::vector<Vec3<float>>& points) {
        for (Deformer& deformer : deformers) {
            for (const std::size_t threads : {1, 4, 0}) {
                EXPECT_TRUE(deformer.deform(scene.posed_from_rest, {{}, threads}, points));
                EXPECT_TRUE(deformer.deform(scene.posed_from_rest, {bones_from_model, threads}, points));
            }
            deformer.set_rest_points(other_rest_points);
        }
    };
    std::vector<std::vector<Vec3<float>>> points(5, scene.rest_points);
    const int allocations_before = allocations;
    frames(points[0]);
    EXPECT_EQ(allocations, allocations_before);
    // Starts the threads, which takes locks of the system.
    const int locks_before = locks;
    for (int round = 0; round < 5; ++round) frames(points[0]);
    EXPECT_EQ(allocations, allocations_before);
    EXPECT_EQ(locks, locks_before);

    // Many threads at once.
    std::atomic<int> waiting{0};
    std::atomic<int> in_frames{0};
    std::vector<std::thread> threads;
    for (auto& of_thread : points) {
        threads.emplace_back([&] {
            ++waiting;
            while (waiting < 5) std::this_thread::yield();
            const int before = allocations;
            for (int round = 0; round < 5; ++round) frames(of_thread);
            in_frames += allocations - before;
        });
    }
    for (std::thread& thread : threads) thread.join();
    // A deformer allocates palettes once for each thread that uses it beside others. Each thread counts all.
    EXPECT_LE(in_frames, 5 * 4 * 3 * static_cast<int>(deformers.size()));
}

TEST(DeltaMush, allocates_nothing_once_it_is_bound) {
    test::Mesh mesh = test::sheet(150);
    const DeltaMush mush(mesh.topology(), mesh.rest_points, {});
    const int allocations_before = allocations;
    for (const std::size_t threads : {1, 4, 0}) EXPECT_TRUE(mush.apply(mesh.rest_points, 1.0f, threads));
    EXPECT_EQ(allocations, allocations_before);
}

TEST(Normals, allocate_nothing_once_they_are_made) {
    const test::Mesh mesh = test::sheet(150);
    std::vector<std::uint8_t> sharp(mesh.edges.size() / 2);
    sharp[7] = 1;
    const Normals normals(mesh.topology(), mesh.rest_points.size(), {sharp, {}});
    for (const NormalDomain domain : {NormalDomain::vertex, NormalDomain::corner, NormalDomain::face}) {
        std::vector<Vec3<float>> result(normals.count(domain));
        const int allocations_before = allocations;
        for (const std::size_t threads : {1, 4, 0})
            EXPECT_TRUE(normals.compute(domain, mesh.rest_points, result, threads));
        EXPECT_EQ(allocations, allocations_before);
        EXPECT_GT(result.back().z, 0.1f);
    }
}

TEST(SkinnedNormals, allocate_nothing_once_they_are_made) {
    const Scene scene = random_scene(2, 20000, 1.0);
    const std::vector<Vec3<float>> normals(scene.rest_points.size(), Vec3<float>(0, 0, 1));
    const SkinnedNormals skinned(Binding(scene.data()), Dq::info, {normals, normals});
    auto points = normals, moved = normals, tangents = normals;
    const int allocations_before = allocations;
    for (const std::size_t threads : {1, 4, 0}) {
        DeformOptions options;
        options.threads = threads;
        EXPECT_TRUE(skinned.deform(scene.posed_from_rest, options, points, moved, tangents));
    }
    EXPECT_EQ(allocations, allocations_before);
    EXPECT_NE(moved.front(), normals.front());
}

TEST(Bindings, are_packed_once) {
    const Scene scene = random_scene(2, 20000, 1.0);
    const std::size_t before = bytes;
    const Binding binding(scene.data());
    const std::size_t of_binding = bytes - before;
    std::vector<Deformer> deformers;
    deformers.reserve(kMethodCount);
    const std::size_t alone = bytes;
    for (const MethodInfo& method : kMethods) deformers.emplace_back(binding, method);
    // Each further deformer only has room for the bones of one thread, most of it for one method's bones of each
    // set. Together this must be far less than one mesh.
    EXPECT_LT(bytes - alone, of_binding / 8);
}

// Bones' numbers are not sizes: memory must not grow with them.
TEST(Bones, of_high_numbers_take_no_memory) {
    std::vector<std::size_t> sizes;
    for (const std::int32_t bone : {0, static_cast<std::int32_t>(kMaxBones) - 1}) {
        Scene scene;
        scene.add_vertex({1, 2, 3}, {{bone, 1.0f}});
        const std::size_t before = bytes;
        const Deformer deformer(scene.data(), Dq::info);
        sizes.push_back(bytes - before);
    }
    // The table that sorts the numbers has 4 bytes for each and is freed afterwards.
    EXPECT_LT(sizes[1], sizes[0] + 5 * kMaxBones);
}

// Includes limits, a bend and a second try.
TEST(InverseKinematics, allocates_nothing_and_locks_nothing) {
    const std::vector<std::int32_t> parents{-1, 0, 1};
    std::vector<BoneLimits> limits(3);
    limits[1][1].is_locked = true;
    limits[1][0] = {.is_limited = true, .min = 0.0, .max = 2.0};
    const std::vector<IkEffector> effectors{{.bone = 2, .rotation_weight = 0.5}};
    IkSolver solver(Skeleton(parents), limits, effectors);
    const DualQuat<double> next = to_dual_quat(QuatVec<double>{{1, 0, 0, 0}, {0, 1, 0}});
    const std::vector<DualQuat<double>> rest{{}, next, next};
    const std::vector<Vec3<double>> tips{{0, 1, 0}};
    std::vector<Quat<double>> rotations(3, Quat<double>(1, 0, 0, 0));
    const int before = allocations;
    const int locks_before = locks;
    for (const IkMethod method : {IkMethod::damped_least_squares, IkMethod::cyclic_descent}) {
        for (int i = 0; i < 20; ++i) {
            const std::array goals{
                to_dual_quat(QuatVec<double>{{1, 0, 0, 0}, {0.1 * i, 2.0 - 0.2 * i, 0.0}})};
            EXPECT_TRUE(solver.solve({{}, rest, tips, goals, {}}, rotations, {.method = method}));
        }
    }
    EXPECT_EQ(allocations, before);
    EXPECT_EQ(locks, locks_before);
}

}  // namespace
}  // namespace sinew
