// SPDX-License-Identifier: GPL-3.0-or-later
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include <algorithm>
#include <bit>
#include <cstdint>

#include "sinew/base/targets.h"
#include "sinew/lanes/palette.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/lanes/plain_bones.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Sets Palette::may_be_plain for each first bone with a pair that would be added plainly.
void mark_plain(const BonePairs& pairs, Palette& palette) {
    const hn::CappedTag<float, kLanes> d;
    const hn::RebindToSigned<decltype(d)> indices;
    const auto alike = hn::Set(d, kAlike * kAlike);
    for (std::size_t i = 0; i < pairs.first.size(); i += hn::Lanes(d)) {
        const std::int32_t* const bones = &pairs.first[i];
        const auto first = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, bones));
        const auto later = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, &pairs.later[i]));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::Not(hn::Lt(first, hn::Mul(alike, later))), bits);
        for (auto plain = static_cast<std::uint32_t>(bits[0] | bits[1] << 8); plain != 0;
             plain &= plain - 1) {
            palette.may_be_plain[bones[std::countr_zero(plain)]] = 1;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {

void find_plain(const BonePairs& pairs, std::size_t bones, Palette& palette) noexcept {
    static constexpr OfTargets<void(const BonePairs&, Palette&)> kMark SINEW_TARGETS(mark_plain);
    std::fill_n(palette.may_be_plain, bones, std::uint8_t{0});
    kMark[target_in_use()](pairs, palette);
}

}  // namespace sinew

#endif
