// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/pose/palette_store.h"

#include <bit>
#include <memory>
#include <new>
#include <numeric>
#include <thread>
#include <utility>

namespace sinew {

static_assert(alignof(Float4) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);

/// One thread's palettes.
struct PaletteStore::Palettes {
    explicit Palettes(const PaletteStore& store) {
        for (std::size_t k = 0; k < store.count_; ++k) {
            add(store.layouts_[k], store.bones_, store.entries_, k);
        }
    }

    void add(const RowLayout& layout, std::size_t bones, std::size_t entries, std::size_t k) {
        const std::size_t rows = layout.are_of_sets ? entries : bones;
        const std::size_t scaled_rows = layout.have_scales ? rows : 0;
        // A bone may be listed twice as scaled: because of its rest axes, and because of its pose.
        const std::size_t scaled_bones = layout.have_scales ? 2 * bones : 0;
        const std::size_t rigid_bones = layout.are_of_sets ? bones : 0;
        std::array<std::size_t, 7> sizes{layout.float4s * rows * sizeof(Float4),
                                         kDisplacementRows * scaled_rows * sizeof(Float4),
                                         rigid_bones * sizeof(RigidBone),
                                         (rows + kSizesAtOnce) * sizeof(float),
                                         scaled_bones * sizeof(std::int32_t),
                                         rows,
                                         scaled_rows};
        for (std::size_t& size : sizes) size = (size + sizeof(Float4) - 1) / sizeof(Float4) * sizeof(Float4);
        // Not initialised: what a pose does not need gets no pages of the system.
        memory[k] = std::make_unique_for_overwrite<std::byte[]>(
            std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}));
        std::byte* at = memory[k].get();
        auto next = [&, part = sizes.begin()]() mutable { return std::exchange(at, at + *part++); };
        Palette& palette = of_kernels[k];
        palette.bones = reinterpret_cast<Float4*>(next());
        palette.scales = reinterpret_cast<Float4*>(next());
        palette.rigid_bones = reinterpret_cast<RigidBone*>(next());
        palette.sizes = reinterpret_cast<float*>(next());
        palette.scaled = reinterpret_cast<std::int32_t*>(next());
        palette.may_need_absolute_sum = reinterpret_cast<std::uint8_t*>(next());
        palette.has_scale = reinterpret_cast<std::uint8_t*>(next());
    }

    std::array<Palette, kMaxKernels> of_kernels{};
    std::array<std::unique_ptr<std::byte[]>, kMaxKernels> memory;
};

PaletteStore::PaletteStore(const std::array<RowLayout, kMaxKernels>& layouts, std::size_t count,
                           std::size_t bones, std::size_t entries)
    : layouts_(layouts), count_(count), bones_(bones), entries_(entries) {
    palettes_[0] = new Palettes(*this);
}

PaletteStore::~PaletteStore() {
    for (const std::atomic<Palettes*>& palettes : palettes_) delete palettes.load(std::memory_order_relaxed);
}

bool PaletteStore::make(std::uint32_t index) noexcept {
    if (palettes_[index].load(std::memory_order_relaxed) != nullptr) return true;
    try {
        // A child that is forked meanwhile finds no palettes, or whole ones.
        palettes_[index].store(new Palettes(*this), std::memory_order_release);
    } catch (const std::bad_alloc&) {
        return false;
    }
    return true;
}

PaletteStore::Reading::Reading(PaletteStore& store) noexcept : store_(store) {
    for (;;) {
        const std::uint32_t before = store.state_.change([](std::uint32_t state) {
            const bool is_free = (state & kWriter) == 0 && (state & kReaders) != kReaders;
            return is_free ? state | (state + 1) : state;  // sets the lowest bit that is not set
        });
        index_ = static_cast<std::uint32_t>(std::countr_one(before));
        if (store.make(index_)) return;
        // Without memory for more, threads take turns.
        store.state_.clear(std::uint32_t{1} << index_);
        std::this_thread::yield();
    }
}

Palette& PaletteStore::Reading::palette(std::size_t kernel) const noexcept {
    return store_.palettes_[index_].load(std::memory_order_relaxed)->of_kernels[kernel];
}

PaletteStore::Writing::Writing(PaletteStore& store) noexcept : store_(store) {
    // Set the writer's bit first, so that threads that deform continuously do not keep it waiting.
    store.state_.change([](std::uint32_t state) { return state | kWriter; });
    store.state_.wait_until_clear(kReaders);
}

}  // namespace sinew
