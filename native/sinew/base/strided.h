// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <concepts>
#include <cstddef>
#include <span>
#include <type_traits>

namespace sinew {

/// Elements that others may lie between, as positions in a vertex buffer that has normals, too. Refers to memory of the
/// caller's. A contiguous range converts to it.
template <class T>
class Strided {
public:
    Strided() = default;

    /// stride  bytes from an element to the next, at least sizeof(T), with which each is aligned
    Strided(T* first, std::size_t count, std::size_t stride) noexcept
        : first_(first), count_(count), stride_(stride) {}

    template <class Range>
    requires std::is_constructible_v<std::span<T>, Range>
    // NOLINTNEXTLINE(google-explicit-constructor): as std::span
    Strided(Range&& range)
    noexcept {
        const std::span<T> elements(range);
        first_ = elements.data();
        count_ = elements.size();
    }

    // NOLINTNEXTLINE(google-explicit-constructor): as std::span
    operator Strided<const T>() const noexcept requires(!std::is_const_v<T>) {
        return {first_, count_, stride_};
    }

    [[nodiscard]] T* data() const noexcept { return first_; }
    [[nodiscard]] std::size_t size() const noexcept { return count_; }
    [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
    /// Whether nothing lies between elements.
    [[nodiscard]] bool is_contiguous() const noexcept { return stride_ == sizeof(T); }

    template <std::integral Index>
    [[nodiscard]] T& operator[](Index i) const noexcept {
        using Byte = std::conditional_t<std::is_const_v<T>, const std::byte, std::byte>;
        return *reinterpret_cast<T*>(reinterpret_cast<Byte*>(first_) + static_cast<std::size_t>(i) * stride_);
    }

private:
    T* first_ = nullptr;
    std::size_t count_ = 0;
    std::size_t stride_ = sizeof(T);
};

}  // namespace sinew
