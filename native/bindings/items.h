// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>

#include "sinew/transform/dual.h"
#include "sinew/transform/make.h"

namespace sinew::bindings {

/// How a value of the library is stored in the last axes of an array:
///   kShape       those axes as text       kSize        number of numbers read
///   kDimensions  sizes of an output       read, write  conversion
template <class Value>
struct Item;

template <class T>
using Scalar = T;

template <class T, std::size_t... dimensions>
struct Numbers {
    using Element = T;
    static constexpr std::size_t kSize = (1 * ... * dimensions);
    static constexpr std::array<std::size_t, sizeof...(dimensions)> kDimensions{dimensions...};
};

template <class T>
struct PlainItem : Numbers<T> {
    static constexpr const char* kShape = "[..]";
    static T read(const T* from) { return *from; }
    static void write(T value, T* to) { *to = value; }
};

template <>
struct Item<float> : PlainItem<float> {};
template <>
struct Item<double> : PlainItem<double> {};
template <>
struct Item<bool> : PlainItem<bool> {};

template <class T>
struct Item<Vec3<T>> : Numbers<T, 3> {
    static constexpr const char* kShape = "[.., 3]";
    static Vec3<T> read(const T* from) { return {from[0], from[1], from[2]}; }
    static void write(const Vec3<T>& v, T* to) {
        for (int i = 0; i < 3; ++i) to[i] = v[i];
    }
};

template <class T>
struct Item<Mat3<T>> : Numbers<T, 3, 3> {
    static constexpr const char* kShape = "[.., 3, 3]";
    static Mat3<T> read(const T* from) {
        Mat3<T> m;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) m[column][row] = from[3 * row + column];
        }
        return m;
    }
    static void write(const Mat3<T>& m, T* to) {
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) to[3 * row + column] = m[column][row];
        }
    }
};

/// Read from three or four rows, without using a fourth one; written with four.
template <class T>
struct Item<Affine<T>> : Numbers<T, 4, 4> {
    static constexpr const char* kShape = "[.., 4, 4] or [.., 3, 4]";
    static constexpr std::size_t kSize = 12;
    static Affine<T> read(const T* from) {
        Affine<T> a;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) a.linear[column][row] = from[4 * row + column];
            a.translation[row] = from[4 * row + 3];
        }
        return a;
    }
    static void write(const Affine<T>& a, T* to) {
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) to[4 * row + column] = a.linear[column][row];
            to[4 * row + 3] = a.translation[row];
            to[12 + row] = T(0);
        }
        to[15] = T(1);
    }
};

template <class T>
struct Item<Quat<T>> : Numbers<T, 4> {
    static constexpr const char* kShape = "[.., 4]";
    static Quat<T> read(const T* from) { return Quat<T>(from[0], {from[1], from[2], from[3]}); }
    static void write(const Quat<T>& q, T* to) {
        to[0] = q.w;
        Item<Vec3<T>>::write(vector_part(q), to + 1);
    }
};

/// Two items, one behind the other.
template <class Pair, class First, class Second>
struct PairItem : Numbers<typename Item<First>::Element, Item<First>::kSize + Item<Second>::kSize> {
    using T = typename Item<First>::Element;
    static Pair read(const T* from) {
        return {Item<First>::read(from), Item<Second>::read(from + Item<First>::kSize)};
    }
    static void write(const Pair& a, T* to) {
        const auto& [first, second] = a;
        Item<First>::write(first, to);
        Item<Second>::write(second, to + Item<First>::kSize);
    }
};

template <class T>
struct Item<QuatVec<T>> : PairItem<QuatVec<T>, Quat<T>, Vec3<T>> {
    static constexpr const char* kShape = "[.., 7]";
};

template <class T>
struct Item<DualQuat<T>> : PairItem<DualQuat<T>, Quat<T>, Quat<T>> {
    static constexpr const char* kShape = "[.., 8]";
};

template <class T>
struct Item<Twist<T>> : PairItem<Twist<T>, Vec3<T>, Vec3<T>> {
    static constexpr const char* kShape = "[.., 6]";
};

template <class T>
struct Item<Dual<T>> : PairItem<Dual<T>, T, T> {
    static constexpr const char* kShape = "[.., 2]";
};

}  // namespace sinew::bindings
