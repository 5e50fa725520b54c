// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "sinew/deform/kernels.h"

namespace sinew {

/// Room for the bones of each thread that deforms a mesh, made with the mesh, so that a frame allocates nothing;
/// and who may read the mesh or write it: many threads that deform, or one that changes the rest points.
///
/// A thread waits only where kMax others deform this very mesh, or where its rest points are being written.
class PaletteStore {
public:
    static constexpr std::uint32_t kMax = 16;
    static constexpr std::size_t kMaxKernels = 2;

    /// kernels  one or two, that each thread deforms by
    /// bones    that the mesh uses
    /// entries  of its BoneSets; 0 where no kernel wants them
    PaletteStore(std::span<const Kernel* const> kernels, std::size_t bones, std::size_t entries);

    /// Palettes that are the caller's, and the mesh to read, as long as this lives.
    class Reading {
    public:
        explicit Reading(PaletteStore& store) noexcept : store_(store), index_(store.start_reading()) {}
        ~Reading() { store_.end_reading(index_); }
        Reading(const Reading&) = delete;
        Reading& operator=(const Reading&) = delete;

        /// Of the kernel with this index.
        [[nodiscard]] Palette& palette(std::size_t kernel) const noexcept {
            return store_.palettes_[kernel][index_];
        }

    private:
        PaletteStore& store_;
        std::uint32_t index_;
    };

    /// The mesh to write, as long as this lives.
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

    /// Of one kernel's palettes.
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
    std::atomic<std::uint32_t> state_{0};  // a bit for each palette in use, one for a writer, then the forks
};

}  // namespace sinew
