// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "sinew/base/fork_safe.h"
#include "sinew/pose/palette.h"

namespace sinew {

/// The palettes that each thread that deforms a mesh writes. Also a readers-writer lock for the mesh: many
/// threads may deform, or one may change the rest points.
///
/// The first thread's palettes are allocated with the mesh, those of another when more threads than ever before
/// deform at once. A thread waits only while kMax others deform this very mesh, while its rest points are being
/// written, or where the system has no memory for further palettes.
class PaletteStore {
public:
    static constexpr std::uint32_t kMax = 16;
    static constexpr std::size_t kMaxKernels = 2;

    /// layouts  of `count` kernels, all used by each thread
    /// bones    number of bones that the mesh uses
    /// entries  number of entries in its BoneSets; 0 if no kernel needs sets
    PaletteStore(const std::array<RowLayout, kMaxKernels>& layouts, std::size_t count, std::size_t bones,
                 std::size_t entries);
    ~PaletteStore();
    PaletteStore(const PaletteStore&) = delete;
    PaletteStore& operator=(const PaletteStore&) = delete;

    /// Holds palettes for the caller, and the mesh for reading, while this object lives.
    class Reading {
    public:
        explicit Reading(PaletteStore& store) noexcept;
        ~Reading() { store_.state_.clear(std::uint32_t{1} << index_); }
        Reading(const Reading&) = delete;
        Reading& operator=(const Reading&) = delete;

        /// The palette for the kernel with this index.
        [[nodiscard]] Palette& palette(std::size_t kernel) const noexcept;

    private:
        PaletteStore& store_;
        std::uint32_t index_;
    };

    /// Holds the mesh for writing while this object lives.
    class Writing {
    public:
        explicit Writing(PaletteStore& store) noexcept;
        ~Writing() { store_.state_.clear(kWriter); }
        Writing(const Writing&) = delete;
        Writing& operator=(const Writing&) = delete;

    private:
        PaletteStore& store_;
    };

private:
    struct Palettes;

    static constexpr std::uint32_t kReaders = (std::uint32_t{1} << kMax) - 1;
    static constexpr std::uint32_t kWriter = kReaders + 1;

    /// Makes the palettes of the thread that has this bit. Returns false without memory.
    bool make(std::uint32_t index) noexcept;

    std::array<RowLayout, kMaxKernels> layouts_;
    std::size_t count_;
    std::size_t bones_;
    std::size_t entries_;
    std::array<std::atomic<Palettes*>, kMax> palettes_{};
    ForkSafeBits<kMax + 1> state_;  // a bit for each of the palettes in use, and one for a writer
};

}  // namespace sinew
