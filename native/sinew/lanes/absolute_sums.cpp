// SPDX-License-Identifier: GPL-3.0-or-later
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include <algorithm>
#include <bit>
#include <cstdint>

#include "sinew/base/targets.h"
#include "sinew/lanes/palette.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/lanes/absolute_sums.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Sets Palette::may_need_absolute_sum for each first bone with a pair that needs an absolute sum.
void mark_absolute_sums(const BonePairs& pairs, Palette& palette) {
    const hn::CappedTag<float, kLanes> d;
    const hn::RebindToSigned<decltype(d)> indices;
    const auto ratio = hn::Set(d, kMaxSizeRatio * kMaxSizeRatio);
    for (std::size_t i = 0; i < pairs.first.size(); i += hn::Lanes(d)) {
        const std::int32_t* const bones = &pairs.first[i];
        const auto first = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, bones));
        const auto later = hn::GatherIndex(d, palette.sizes, hn::LoadU(indices, &pairs.later[i]));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::Not(hn::Lt(first, hn::Mul(ratio, later))), bits);
        for (auto pairs_left = static_cast<std::uint32_t>(bits[0] | bits[1] << 8); pairs_left != 0;
             pairs_left &= pairs_left - 1) {
            palette.may_need_absolute_sum[bones[std::countr_zero(pairs_left)]] = 1;
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sinew {

void find_absolute_sums(const BonePairs& pairs, std::size_t bones, Palette& palette) noexcept {
    static constexpr OfTargets<void(const BonePairs&, Palette&)> kMark SINEW_TARGETS(mark_absolute_sums);
    std::fill_n(palette.may_need_absolute_sum, bones, std::uint8_t{0});
    kMark[target_in_use()](pairs, palette);
}

}  // namespace sinew

#endif
