// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace sinew {

/// Dual number real + e dual, e^2 = 0 (Clifford 1873; Smith 2013, section 2.2.3, whose printed product a1 b1 is a
/// misprint of a1 a2). The default is 0.
template <class T>
struct Dual {
    T real = T(0);
    T dual = T(0);

    friend bool operator==(const Dual&, const Dual&) = default;
};

template <class T>
[[nodiscard]] Dual<T> operator+(const Dual<T>& a, const Dual<T>& b) noexcept {
    return {a.real + b.real, a.dual + b.dual};
}

template <class T>
[[nodiscard]] Dual<T> operator-(const Dual<T>& a, const Dual<T>& b) noexcept {
    return {a.real - b.real, a.dual - b.dual};
}

template <class T>
[[nodiscard]] Dual<T> operator-(const Dual<T>& a) noexcept {
    return {-a.real, -a.dual};
}

template <class T>
[[nodiscard]] Dual<T> operator*(const Dual<T>& a, const Dual<T>& b) noexcept {
    return {a.real * b.real, a.real * b.dual + a.dual * b.real};
}

/// Requires b.real != 0: a dual number without a real part has no inverse.
template <class T>
[[nodiscard]] Dual<T> operator/(const Dual<T>& a, const Dual<T>& b) noexcept {
    return {a.real / b.real, (a.dual * b.real - a.real * b.dual) / (b.real * b.real)};
}

/// The conjugate: real - e dual.
template <class T>
[[nodiscard]] Dual<T> conjugate(const Dual<T>& a) noexcept {
    return {a.real, -a.dual};
}

// A function f of a dual number is f(real) + e dual f'(real), since its Taylor series ends after one term.

/// Requires real > 0.
template <class T>
[[nodiscard]] Dual<T> sqrt(const Dual<T>& a) noexcept {
    using std::sqrt;
    const T root = sqrt(a.real);
    return {root, a.dual / (T(2) * root)};
}

template <class T>
[[nodiscard]] Dual<T> sin(const Dual<T>& a) noexcept {
    using std::cos;
    using std::sin;
    return {sin(a.real), a.dual * cos(a.real)};
}

template <class T>
[[nodiscard]] Dual<T> cos(const Dual<T>& a) noexcept {
    using std::cos;
    using std::sin;
    return {cos(a.real), -a.dual * sin(a.real)};
}

template <class T>
[[nodiscard]] Dual<T> exp(const Dual<T>& a) noexcept {
    using std::exp;
    const T power = exp(a.real);
    return {power, a.dual * power};
}

/// Requires real > 0.
template <class T>
[[nodiscard]] Dual<T> log(const Dual<T>& a) noexcept {
    using std::log;
    return {log(a.real), a.dual / a.real};
}

}  // namespace sinew
