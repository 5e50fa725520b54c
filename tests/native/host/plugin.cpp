// SPDX-License-Identifier: GPL-3.0-or-later
// A library that a host loads and unloads; see unload_test.cpp.
#include <vector>

#include "sinew/base/thread_pool.h"
#include "sinew/deformer.h"

extern "C" __attribute__((visibility("default"))) int work_on_threads(int threads) {
    const std::size_t count = 100'000;
    const std::vector<sinew::Vec3<float>> rest(count, sinew::Vec3<float>(1.0f, 2.0f, 3.0f));
    std::vector<std::int32_t> offsets(count + 1), bones(count, 0);
    for (std::size_t i = 0; i <= count; ++i) offsets[i] = static_cast<std::int32_t>(i);
    const std::vector<float> weights(count, 1.0f);
    const sinew::Deformer deformer({rest, offsets, bones, weights}, sinew::Dq::info);
    std::vector<sinew::Affine<float>> pose(1);
    pose[0].translation = {1.0f, 1.0f, 1.0f};
    std::vector<sinew::Vec3<float>> points(count);
    static_cast<void>(deformer.deform({pose}, {static_cast<std::size_t>(threads)}, points));
    return points.front() == sinew::Vec3<float>(2.0f, 3.0f, 4.0f) && points.back() == points.front() ? 1 : 0;
}

extern "C" __attribute__((visibility("default"))) void end_threads() { sinew::end_threads(); }
