// SPDX-License-Identifier: GPL-3.0-or-later
// Random numbers, distances and checks that all C++ tests use.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <random>
#include <vector>

#include "sinew/mesh/influence.h"
#include "sinew/transform/convert.h"

namespace sinew::test {

/// Random numbers that are the same on every machine, unlike the standard's distributions.
class Random {
public:
    explicit Random(std::uint32_t seed) : engine_(seed) {}

    double uniform(double low, double high) {
        return low + (high - low) * (static_cast<double>(engine_()) / 4294967296.0);
    }

    std::int32_t index(std::int32_t end) { return static_cast<std::int32_t>(uniform(0.0, end)); }

    Vec3<double> vector(double extent) {
        const double x = uniform(-extent, extent);
        const double y = uniform(-extent, extent);
        return {x, y, uniform(-extent, extent)};
    }

    Quat<double> rotation() {
        for (;;) {
            const Vec3<double> v = vector(1.0);
            const Quat<double> q(uniform(-1.0, 1.0), v.x, v.y, v.z);
            if (glm::length(q) > 0.1) return glm::normalize(q);
        }
    }

    QuatVec<double> motion(double extent) {
        const Quat<double> q = rotation();
        return {q, vector(extent)};
    }

    /// Positive weights with sum 1, for different bones if there are enough.
    template <class T>
    std::vector<Influence<T>> influences(std::size_t count, std::int32_t bones) {
        std::vector<Influence<T>> result;
        double sum = 0.0;
        const std::int32_t first = index(bones);
        for (std::size_t i = 0; i < count; ++i) {
            const double weight = uniform(0.05, 1.0);
            sum += weight;
            result.push_back({(first + static_cast<std::int32_t>(i)) % bones, static_cast<T>(weight)});
        }
        for (Influence<T>& influence : result) influence.weight = static_cast<T>(influence.weight / sum);
        return result;
    }

private:
    std::mt19937 engine_;
};

template <class T>
Quat<T> about(const Vec3<T>& axis, T degrees) {
    return glm::angleAxis(degrees * std::numbers::pi_v<T> / T(180), glm::normalize(axis));
}

template <class T>
Affine<T> scaling(const Vec3<T>& factors) {
    Affine<T> a;
    for (int i = 0; i < 3; ++i) a.linear[i][i] = factors[i];
    return a;
}

template <class T>
double distance(const Vec3<T>& a, const Vec3<T>& b) {
    return static_cast<double>(glm::length(a - b));
}

/// The largest difference of an entry.
template <class T>
double distance(const Affine<T>& a, const Affine<T>& b) {
    double largest = distance(a.translation, b.translation);
    for (int i = 0; i < 3; ++i) largest = std::max(largest, distance(a.linear[i], b.linear[i]));
    return largest;
}

template <class T>
bool same_bits(const Vec3<T>& a, const Vec3<T>& b) {
    return std::memcmp(&a, &b, sizeof(a)) == 0;
}

inline bool same_bits(const std::vector<Vec3<float>>& a, const std::vector<Vec3<float>>& b) {
    return std::ranges::equal(a, b, [](const auto& one, const auto& other) { return same_bits(one, other); });
}

/// The largest distance of two points with the same index.
inline double largest_error(const std::vector<Vec3<float>>& points,
                            const std::vector<Vec3<double>>& expected) {
    double largest = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        largest = std::max(largest, distance(Vec3<double>(points[i]), expected[i]));
    }
    return largest;
}

}  // namespace sinew::test
