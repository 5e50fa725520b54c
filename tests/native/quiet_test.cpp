// SPDX-License-Identifier: GPL-3.0-or-later
// A frame allocates nothing and locks nothing. A program of its own, as it counts what everything in it does.
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <new>

#include "scene.h"

#ifdef __GLIBC__
#include <dlfcn.h>
#include <pthread.h>
#endif

namespace {

std::atomic<int> allocations{0};
std::atomic<int> locks{0};

}  // namespace

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    allocations.fetch_add(1);
    return std::malloc(std::max<std::size_t>(size, 1));
}

void* operator new(std::size_t size) {
    if (void* const memory = operator new(size, std::nothrow)) return memory;
    throw std::bad_alloc();
}

void* operator new(std::size_t size, std::align_val_t alignment) {
    allocations.fetch_add(1);
    const auto unit = static_cast<std::size_t>(alignment);
    if (void* const memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return memory;
    throw std::bad_alloc();
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

// The thread sanitizer has one of its own there.
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

TEST(Frames, allocate_nothing_and_lock_nothing) {
    // Sets of all sizes, scaled bones among them, and more blocks than one piece of a thread's work.
    Scene scene = random_scene(1, 20000, 1.0);
    const Affine<float> bones_from_model{to_mat3(about<float>({1, 2, 3}, 40.0f)), {1, -2, 3}};
    std::vector<Vec3<float>> points(scene.rest_points.size());
    for (const Method& method : kMethods) {
        const Deformer deformer(method.id, scene.data());
        const auto frame = [&](std::size_t threads) {
            deformer.deform(scene.posed_from_rest, {{}, threads}, points);
            deformer.deform(scene.posed_from_rest, {bones_from_model, threads}, points);
        };
        // The first starts threads and makes room for the bones.
        for (const std::size_t threads : {1, 4}) frame(threads);
        const int allocations_before = allocations;
        const int locks_before = locks;
        for (int round = 0; round < 5; ++round) {
            for (const std::size_t threads : {1, 4}) frame(threads);
        }
        EXPECT_EQ(allocations, allocations_before) << method.name;
        EXPECT_EQ(locks, locks_before) << method.name;
    }
}

}  // namespace
}  // namespace sinew
