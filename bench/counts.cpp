// SPDX-License-Identifier: GPL-3.0-or-later
// Runs each kernel once, for callgrind to count its instructions: one dump for each case, with its name.
#define GLM_ENABLE_EXPERIMENTAL
#include <valgrind/callgrind.h>

#include <cstdio>
#include <string>

#include "scenes.h"
#include "sinew/base/simd.h"
#include "sinew/methods/methods.h"

namespace {

using namespace sinew;
using namespace sinew::bench;

template <class Call>
void count(const std::string& name, const Call& call) {
    // The first call allocates memory and starts threads.
    call();
    CALLGRIND_ZERO_STATS;
    CALLGRIND_TOGGLE_COLLECT;
    call();
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS_AT(name.c_str());
}

}  // namespace

int main() {
    if (RUNNING_ON_VALGRIND == 0) {
        std::fputs("run this under valgrind --tool=callgrind --collect-atstart=no\n", stderr);
        return 2;
    }
    use_simd_target("AVX2");
    for (const Kind kind : {Kind::chain, Kind::shuffled, Kind::character}) {
        Scene scene = make_scene({kind, 10'000});
        const std::string of = std::string("/") + kKindNames[static_cast<int>(kind)];
        for (const MethodInfo& method : kMethods) {
            const Deformer deformer(scene.data_for(method), method);
            count(std::string(method.name) + of, [&] {
                (void)deformer.deform(scene.pose, {{}, 1}, scene.points);
            });
            for (const Variant& variant : variants_of(method)) {
                count(variant.name + of,
                      [&] { (void)deformer.deform(scene.pose, variant.options(), scene.points); });
            }
        }
        count("bind" + of, [&] { const Deformer deformer(scene.data(), Dq::info); });
    }
    Scene bones = make_scene({Kind::chain, 1000, 1000, 1});
    for (const MethodInfo& method : kMethods) {
        const Deformer deformer(bones.data_for(method), method);
        count(std::string(method.name) + "/bones", [&] {
            (void)deformer.deform(bones.pose, {{}, 1}, bones.points);
        });
    }
    return 0;
}
