// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "sinew/deform/kernels.h"

namespace sinew {

/// Palettes for each thread that deforms a mesh, allocated with the mesh, so that a frame does not allocate. Also
/// a readers-writer lock for the mesh: many threads may deform, or one may change the rest points.
///
/// A thread waits only while kMax others deform this very mesh, or while its rest points are being written.
class PaletteStore {
public:
    static constexpr std::uint32_t kMax = 16;
    static constexpr std::size_t kMaxKernels = 2;

    /// Allocates the palettes.
    ///
    /// kernels  one or two, all used by each thread
    /// bones    number of bones that the mesh uses
    /// entries  number of entries in its BoneSets; 0 if no kernel needs sets
    PaletteStore(std::span<const Kernel* const> kernels, std::size_t bones, std::size_t entries);

    /// Holds palettes for the caller, and the mesh for reading, while this object lives.
    class Reading {
    public:
        explicit Reading(PaletteStore& store) noexcept : store_(store), index_(store.start_reading()) {}
        ~Reading() { store_.end_reading(index_); }
        Reading(const Reading&) = delete;
        Reading& operator=(const Reading&) = delete;

        /// The palette for the kernel with this index.
        [[nodiscard]] Palette& palette(std::size_t kernel) const noexcept {
            return store_.palettes_[kernel][index_];
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
    std::uint32_t start_reading() noexcept;
    void end_reading(std::uint32_t index) noexcept;
    void start_writing() noexcept;
    void end_writing() noexcept;
    template <class Next>
    std::uint32_t change(const Next& next) noexcept;

    /// The memory of one kernel's palettes.
    struct Memory {
        std::unique_ptr<Float4[]> float4s;
        std::unique_ptr<float[]> sizes;
        std::unique_ptr<std::uint8_t[]> may_be_plain;
        std::unique_ptr<std::int32_t[]> scaled;
        std::unique_ptr<std::uint8_t[]> has_scale;
        std::unique_ptr<std::byte[]> set_bones;
    };

    Memory memory_[kMaxKernels];
    Palette palettes_[kMaxKernels][kMax];
    // a bit for each palette in use, one for a writer, and above them forks()
    std::atomic<std::uint32_t> state_{0};
};

}  // namespace sinew
