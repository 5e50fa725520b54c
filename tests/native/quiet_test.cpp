// SPDX-License-Identifier: GPL-3.0-or-later
// Protects frames from allocations and locks: they are counted, in a program of its own, as that counts everything
// in the process.
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "polygons.h"
#include "scene.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif
#include "sinew/normals.h"
#include "sinew/skinned_normals.h"
#include "sinew/stages/twist_spread/twist_spread.h"

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
std::atomic<int> beside{0};
std::atomic<bool> has_memory{true};

}  // namespace

// The thread sanitizer defines its own.
#if defined(__GLIBC__) && !defined(__SANITIZE_THREAD__)
#define SINEW_COUNTS_ALL
// Memory that does not come from operator new.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t unit, std::size_t size);

void* malloc(std::size_t size) { return beside.fetch_add(1), __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return beside.fetch_add(1), __libc_calloc(count, size); }
void* realloc(void* memory, std::size_t size) { return beside.fetch_add(1), __libc_realloc(memory, size); }
void* aligned_alloc(std::size_t unit, std::size_t size) {
    return beside.fetch_add(1), __libc_memalign(unit, size);
}
int posix_memalign(void** memory, std::size_t unit, std::size_t size) {
    *memory = aligned_alloc(unit, size);
    return *memory == nullptr ? ENOMEM : 0;
}
}
#endif

namespace {

void* allocate(std::size_t size) {
#ifdef SINEW_COUNTS_ALL
    return __libc_malloc(size);
#else
    return std::malloc(size);
#endif
}

// Windows has other functions for aligned memory, with their own deallocation function.
void* allocate_aligned(std::size_t unit, std::size_t size) {
#ifdef _WIN32
    return _aligned_malloc(size, unit);
#else
    const std::size_t whole = (size + unit - 1) / unit * unit;
#ifdef SINEW_COUNTS_ALL
    return __libc_memalign(unit, whole);
#else
    return std::aligned_alloc(unit, whole);
#endif
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
    return !has_memory ? nullptr : allocate(std::max<std::size_t>(size, 1));
}

void* operator new(std::size_t size) {
    if (void* const memory = operator new(size, std::nothrow)) return memory;
    throw std::bad_alloc();
}

void* operator new(std::size_t size, std::align_val_t alignment) {
    allocations.fetch_add(1);
    const auto unit = static_cast<std::size_t>(alignment);
    if (void* const memory = has_memory ? allocate_aligned(unit, size) : nullptr) return memory;
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

#ifdef SINEW_COUNTS_ALL
extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) {
    using Lock = int (*)(pthread_mutex_t*);
    static std::atomic<Lock> lock{nullptr};
    if (lock.load() == nullptr) lock.store(reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock")));
    locks.fetch_add(1);
    return lock.load()(mutex);
}
#endif

namespace sinew::test {
namespace {

TEST(Counting, sees_what_there_is) {
    const int before = allocations;
    const auto number = std::make_unique<int>(1);
    EXPECT_EQ(allocations, before + *number);
#ifdef SINEW_COUNTS_ALL
    const int locks_before = locks;
    static std::mutex mutex;
    const std::lock_guard guard(mutex);
    EXPECT_EQ(locks, locks_before + 1);
    const int beside_before = beside;
    std::free(std::malloc(*number));
    std::free(std::aligned_alloc(64, 64));
    EXPECT_EQ(beside, beside_before + 2);
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
                EXPECT_EQ(deformer.deform({scene.posed_from_rest}, {threads}, points), Status::ok);
                EXPECT_EQ(deformer.deform({scene.posed_from_rest, bones_from_model}, {threads}, points),
                          Status::ok);
            }
            EXPECT_EQ(deformer.set_rest_points(other_rest_points), Status::ok);
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

// What throws nothing says by its status that memory is missing, and nothing has changed.
TEST(Frames, without_memory_change_nothing) {
    const Scene scene = random_scene(7, 3000, 1.0);
    const Binding binding(scene.data());
    const std::vector<Affine<float>> rest_bones(scene.posed_from_rest.size());
    const TwistBone twist{0, 0, 1, false, {0, 0, 0}, {0, 1, 0}};
    const std::vector<Vec3<float>> along_z(scene.rest_points.size(), Vec3<float>(0, 0, 1));
    Deformer deformer(binding, Dq::info);
    TwistSpread spread(binding, {std::span(&twist, 1), rest_bones});
    const auto before = deformed(deformer, scene);
    const auto results = [&] {
        return std::array{deformer.set_rest_points(along_z), spread.set_rest_points(along_z)};
    };
    has_memory = false;
    const auto without = results();
    has_memory = true;
    EXPECT_EQ(without, (std::array{Status::memory, Status::memory}));
    EXPECT_TRUE(same_bits(deformed(deformer, scene), before));
    EXPECT_EQ(results(), (std::array{Status::ok, Status::ok}));
    EXPECT_FALSE(same_bits(deformed(deformer, scene), before));
}

template <auto function>
constexpr bool is_nothrow_v = false;
template <class T, class... Arguments, Status (T::*function)(Arguments...) noexcept>
constexpr bool is_nothrow_v<function> = true;

TEST(Stages, allocate_nothing_once_rest_points_were_set) {
    Scene scene = random_scene(5, 20000, 1.0);
    const Binding binding(scene.data());
    const std::size_t bones = scene.posed_from_rest.size();
    const std::vector<BoneSegment<float>> segments(bones, {{0, 0, 0}, {0, 1, 0}});
    const std::vector<Affine<float>> rest_bones(bones);
    const TwistBone twist{0, 0, 1, false, {0, 0, 0}, {0, 1, 0}};
    BulgeLimit limit(binding, {segments});
    TwistSpread spread(binding, {std::span(&twist, 1), rest_bones});
    auto points = scene.rest_points;
    const auto frame = [&] {
        EXPECT_EQ(limit.set_rest_points(scene.rest_points), Status::ok);
        EXPECT_EQ(spread.set_rest_points(scene.rest_points), Status::ok);
        EXPECT_EQ(spread.apply(points, {scene.posed_from_rest}, {}), Status::ok);
        EXPECT_EQ(limit.apply(points, {scene.posed_from_rest}, {}), Status::ok);
    };
    frame();
    const int before = allocations;
    frame();
    EXPECT_EQ(allocations, before);
    static_assert(is_nothrow_v<&BulgeLimit::set_rest_points> && is_nothrow_v<&TwistSpread::set_rest_points> &&
                  is_nothrow_v<&Deformer::set_rest_points>);
    points.front().x = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(limit.set_rest_points(points), Status::not_finite);
    EXPECT_EQ(spread.set_rest_points(points), Status::not_finite);
    EXPECT_EQ(limit.set_rest_points(scene.rest_points, {Mat3<float>(0.0f), {}}), Status::not_finite);
    EXPECT_EQ(spread.set_rest_points(scene.rest_points, {Mat3<float>(0.0f), {}}), Status::not_finite);
}

#ifdef SINEW_COUNTS_ALL
// That of aligned data, too: whoever replaces operator new has all memory of the library.
TEST(Memory, comes_from_operator_new) {
    const Scene scene = random_scene(6, 2000, 1.0);
    const Mesh mesh = sheet(50);
    const auto work = [&] {
        auto points = scene.rest_points;
        const Binding binding(scene.data());
        for (const MethodInfo& method : kMethods) {
            Deformer deformer(binding, method);
            EXPECT_EQ(deformer.set_rest_points(scene.rest_points), Status::ok);
            EXPECT_EQ(deformer.deform({scene.posed_from_rest}, {4}, points), Status::ok);
        }
        const DeltaMush mush(mesh.topology(), mesh.rest_points, {});
        const Normals normals(mesh.topology(), mesh.rest_points.size(), {});
        const SkinnedNormals skinned(binding, Dq::info, {points, points});
        Job job;
        EXPECT_EQ(centres_of_rotation(scene.data(), {}, job).size(), points.size());
#if SINEW_WITH_DDM
        const int of_others = beside;
        EXPECT_FALSE(direct_delta_mush(scene.data(), {}, 0.1, job).empty());
        // Eigen's solver has its own.
        beside = of_others;
#endif
    };
    // Starts threads, which have memory of the system.
    work();
    const int before = beside;
    const int counted = allocations;
    work();
    EXPECT_EQ(beside, before);
    EXPECT_GT(allocations, counted + 100);
}
#endif

TEST(DeltaMush, and_normals_allocate_nothing_once_they_are_made) {
    Mesh mesh = sheet(150);
    const Scene scene = random_scene(2, 20000, 1.0);
    std::vector<std::uint8_t> sharp(mesh.edges.size() / 2);
    sharp[7] = 1;
    const Normals normals(mesh.topology(), mesh.rest_points.size(), {sharp, {}});
    const DeltaMush mush(mesh.topology(), mesh.rest_points, {});
    const std::vector<Vec3<float>> along_z(scene.rest_points.size(), Vec3<float>(0, 0, 1));
    const SkinnedNormals skinned(Binding(scene.data()), Dq::info, {along_z, along_z});
    auto points = along_z, moved = along_z, tangents = along_z;
    for (const std::size_t threads : {1, 4, 0}) {
        DeformOptions options;
        options.threads = threads;
        int before = allocations;
        EXPECT_EQ(mush.apply(mesh.rest_points, 1.0f, threads), Status::ok);
        EXPECT_EQ(skinned.deform({scene.posed_from_rest}, options, points, moved, tangents), Status::ok);
        EXPECT_EQ(allocations, before);
        for (const NormalDomain domain : {NormalDomain::vertex, NormalDomain::corner, NormalDomain::face}) {
            std::vector<Vec3<float>> result(normals.count(domain));
            before = allocations;
            EXPECT_EQ(normals.compute(domain, mesh.rest_points, result, threads), Status::ok);
            EXPECT_EQ(allocations, before);
            EXPECT_GT(result.back().z, 0.1f);
        }
    }
    EXPECT_NE(moved.front(), along_z.front());
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

}  // namespace
}  // namespace sinew::test
