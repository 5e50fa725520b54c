// SPDX-License-Identifier: GPL-3.0-or-later
// Protects a host that loads the library, uses its threads, ends them and unloads the library.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace {

#ifdef __linux__
std::ptrdiff_t thread_count() {
    const std::filesystem::directory_iterator threads("/proc/self/task");
    return std::distance(begin(threads), end(threads));
}

bool is_loaded(const std::string& name) {
    std::ifstream maps("/proc/self/maps");
    const std::string text((std::istreambuf_iterator<char>(maps)), {});
    return text.find(name) != std::string::npos;
}
#endif

TEST(Host, may_unload_the_library_after_its_threads_ended) {
    for (int round = 0; round < 3; ++round) {
        void* const plugin = dlopen(SINEW_PLUGIN, RTLD_NOW | RTLD_LOCAL);
        ASSERT_NE(plugin, nullptr) << dlerror();
        const auto work = reinterpret_cast<int (*)(int)>(dlsym(plugin, "work_on_threads"));
        const auto end = reinterpret_cast<void (*)()>(dlsym(plugin, "end_threads"));
#ifdef __linux__
        const auto before = thread_count();
#endif
        end();  // when there are none
        EXPECT_EQ(work(4), 1);
#ifdef __linux__
        EXPECT_EQ(thread_count(), before + 3);
        end();
        EXPECT_EQ(thread_count(), before);
#endif
        EXPECT_EQ(work(3), 1);
        end();
        ASSERT_EQ(dlclose(plugin), 0);
#if defined(__linux__) && !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
        EXPECT_FALSE(is_loaded("libsinew.so"));
#endif
    }
}

}  // namespace
