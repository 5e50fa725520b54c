// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/deform/palette_store.h"

#include <bit>

#include "sinew/deform/forks.h"

namespace sinew {
namespace {

constexpr std::uint32_t kReaders = (std::uint32_t{1} << PaletteStore::kMax) - 1;
constexpr std::uint32_t kWriter = kReaders + 1;
constexpr std::uint32_t kForks = ~(kReaders | kWriter);
constexpr std::uint32_t kOneFork = kWriter << 1;

/// `state` as it applies to this process. A forked child has none of the threads that used its parent's palettes,
/// and would otherwise wait for them forever.
std::uint32_t of_this_process(std::uint32_t state) noexcept {
    const std::uint32_t forked = kOneFork * forks();
    return (state & kForks) == forked ? state : forked;
}

}  // namespace

PaletteStore::PaletteStore(std::span<const Kernel* const> kernels, std::size_t bones, std::size_t entries) {
    // Not initialised, so that the system provides no pages for palettes that are never used: only the first is,
    // if one thread at a time deforms.
    for (std::size_t k = 0; k < kernels.size(); ++k) {
        const bool may_scale = kernels[k]->is_rigid;
        const std::size_t of_set_bones = kernels[k]->set_bone_size * bones;
        const std::size_t rows = of_set_bones > 0 ? entries : bones;
        const std::size_t of_bones = kernels[k]->rest_row.size() * rows;
        const std::size_t of_scales = may_scale ? kDisplacementRows * rows : 0;
        const std::size_t of_sizes = rows + kSizesAtOnce;
        Memory& memory = memory_[k];
        memory.float4s = std::make_unique_for_overwrite<Float4[]>(kMax * (of_bones + of_scales));
        memory.sizes = std::make_unique_for_overwrite<float[]>(kMax * of_sizes);
        memory.may_be_plain = std::make_unique_for_overwrite<std::uint8_t[]>(kMax * rows);
        if (may_scale) {
            // A bone may be listed twice: because of its rest axes, and because of its pose.
            memory.scaled = std::make_unique_for_overwrite<std::int32_t[]>(kMax * 2 * bones);
            memory.has_scale = std::make_unique_for_overwrite<std::uint8_t[]>(kMax * rows);
        }
        if (of_set_bones > 0)
            memory.set_bones = std::make_unique_for_overwrite<std::byte[]>(kMax * of_set_bones);
        for (std::size_t i = 0; i < kMax; ++i) {
            Palette& palette = palettes_[k][i];
            palette.bones = memory.float4s.get() + i * (of_bones + of_scales);
            palette.sizes = memory.sizes.get() + i * of_sizes;
            palette.may_be_plain = memory.may_be_plain.get() + i * rows;
            if (!may_scale) continue;
            palette.scales = palette.bones + of_bones;
            palette.scaled = memory.scaled.get() + i * 2 * bones;
            palette.has_scale = memory.has_scale.get() + i * rows;
            palette.set_bones = memory.set_bones.get() + i * of_set_bones;
        }
    }
}

/// Replaces the state by next(state), and waits while both are equal. Returns the state before.
template <class Next>
std::uint32_t PaletteStore::change(const Next& next) noexcept {
    for (std::uint32_t stored = state_.load(std::memory_order_relaxed);;) {
        const std::uint32_t state = of_this_process(stored);
        if (const std::uint32_t after = next(state); after == state) {
            state_.wait(stored, std::memory_order_relaxed);
            stored = state_.load(std::memory_order_relaxed);
        } else if (state_.compare_exchange_weak(stored, after, std::memory_order_acq_rel,
                                                std::memory_order_relaxed)) {
            return state;
        }
    }
}

std::uint32_t PaletteStore::start_reading() noexcept {
    const std::uint32_t before = change([](std::uint32_t state) {
        const bool is_free = (state & kWriter) == 0 && (state & kReaders) != kReaders;
        return is_free ? state | (state + 1) : state;  // sets the lowest bit that is not set
    });
    return static_cast<std::uint32_t>(std::countr_one(before));
}

void PaletteStore::end_reading(std::uint32_t index) noexcept {
    state_.fetch_and(~(std::uint32_t{1} << index), std::memory_order_release);
    state_.notify_all();
}

void PaletteStore::start_writing() noexcept {
    // Set the writer's bit first, so that threads that deform continuously do not keep it waiting.
    change([](std::uint32_t state) { return state | kWriter; });
    for (;;) {
        const std::uint32_t state = state_.load(std::memory_order_acquire);
        if ((state & kReaders) == 0) return;
        state_.wait(state, std::memory_order_relaxed);
    }
}

void PaletteStore::end_writing() noexcept {
    state_.fetch_and(~kWriter, std::memory_order_release);
    state_.notify_all();
}

}  // namespace sinew
