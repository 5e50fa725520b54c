// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sinew/base/fork_safe.h"
#include "sinew/lanes/kernel.h"

namespace sinew {

/// Palettes for each thread that deforms a mesh. Also a readers-writer lock for the mesh: many threads may deform,
/// or one may change the rest points.
///
/// The first thread's palettes are allocated with the mesh, those of another when more threads than ever before
/// deform at once. A thread waits only while kMax others deform this very mesh, while its rest points are being
/// written, or where the system has no memory for further palettes.
class PaletteStore {
public:
    static constexpr std::uint32_t kMax = 16;
    static constexpr std::size_t kMaxKernels = 2;

    /// kernels  one or two, all used by each thread
    /// bones    number of bones that the mesh uses
    /// entries  number of entries in its BoneSets; 0 if no kernel needs sets
    PaletteStore(std::span<const Kernel* const> kernels, std::size_t bones, std::size_t entries);
    ~PaletteStore();
    PaletteStore(const PaletteStore&) = delete;
    PaletteStore& operator=(const PaletteStore&) = delete;

    /// Holds palettes for the caller, and the mesh for reading, while this object lives.
    class Reading {
    public:
        explicit Reading(PaletteStore& store) noexcept : store_(store), index_(store.start_reading()) {}
        ~Reading() { store_.end_reading(index_); }
        Reading(const Reading&) = delete;
        Reading& operator=(const Reading&) = delete;

        /// The palette for the kernel with this index.
        [[nodiscard]] Palette& palette(std::size_t kernel) const noexcept {
            return store_.palette(kernel, index_);
        }

    private:
        PaletteStore& store_;
        std::uint32_t index_;
    };

    /// Holds the mesh for writing while this object lives.
    class Writing {
    public:
        explicit Writing(PaletteStore& store) noexcept : store_(store) { store.start_writing(); }
        ~Writing() { store_.end_writing(); }
        Writing(const Writing&) = delete;
        Writing& operator=(const Writing&) = delete;

    private:
        PaletteStore& store_;
    };

private:
    struct Palettes;

    std::uint32_t start_reading() noexcept;
    void end_reading(std::uint32_t index) noexcept;
    void start_writing() noexcept;
    void end_writing() noexcept;
    /// Makes the palettes of the thread that has this bit. Returns false without memory.
    bool make(std::uint32_t index) noexcept;
    [[nodiscard]] Palette& palette(std::size_t kernel, std::uint32_t index) noexcept;

    std::array<const Kernel*, kMaxKernels> kernels_{};
    std::size_t bones_;
    std::size_t entries_;
    std::array<std::atomic<Palettes*>, kMax> palettes_{};
    ForkSafeBits<kMax + 1> state_;  // a bit for each of the palettes in use, and one for a writer
};

}  // namespace sinew
