// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <concepts>
#include <limits>

namespace experiments {

/// Counts of operations on numbers. The report does not count comparisons and changes of sign, so totals leave
/// them out.
struct Operations {
    int additions = 0;        ///< and subtractions
    int multiplications = 0;  ///< except for those by 2
    int doublings = 0;
    int divisions = 0;
    int roots = 0;
    int functions = 0;  ///< sin, cos, atan2, hypot
    int comparisons = 0;
    int negations = 0;

    [[nodiscard]] int total() const {
        return additions + multiplications + doublings + divisions + roots + functions;
    }
};

/// A number that counts operations on it, by the rule of Smith 2013, section 3.4.2: multiplications by 0 or 1 and
/// additions of 0 are not counted if they are visible in the source. A number made from a C++ number is such a
/// constant; input() makes one that is not known in advance.
class Counted {
public:
    Counted() = default;
    template <class Number>
    requires std::floating_point<Number> || std::integral<Number>
    constexpr Counted(Number value) : value_(static_cast<double>(value)), is_constant_(true) {}

    [[nodiscard]] static constexpr Counted input(double value) { return {value, false}; }
    [[nodiscard]] double value() const { return value_; }

    /// While this object exists, operations are counted in its Operations.
    class CountIn {
    public:
        explicit CountIn(Operations& operations) : before_(counts_) { counts_ = &operations; }
        CountIn(const CountIn&) = delete;
        CountIn& operator=(const CountIn&) = delete;
        ~CountIn() { counts_ = before_; }

    private:
        Operations* before_;
    };

    friend Counted operator+(Counted a, Counted b) {
        if (a.is(0)) return b;
        if (b.is(0)) return a;
        return result(a, b, a.value_ + b.value_, &Operations::additions);
    }
    friend Counted operator-(Counted a, Counted b) {
        if (a.is(0)) return -b;
        if (b.is(0)) return a;
        return result(a, b, a.value_ - b.value_, &Operations::additions);
    }
    friend Counted operator*(Counted a, Counted b) {
        if (a.is(0) || b.is(1)) return a;
        if (b.is(0) || a.is(1)) return b;
        const bool doubles = a.is(2) || b.is(2);
        return result(a, b, a.value_ * b.value_,
                      doubles ? &Operations::doublings : &Operations::multiplications);
    }
    friend Counted operator/(Counted a, Counted b) {
        if (a.is(0) || b.is(1)) return a;
        return result(a, b, a.value_ / b.value_, &Operations::divisions);
    }
    friend Counted operator-(Counted a) { return result(a, a, -a.value_, &Operations::negations); }
    friend Counted operator+(Counted a) { return a; }
    Counted& operator+=(Counted b) { return *this = *this + b; }
    Counted& operator-=(Counted b) { return *this = *this - b; }
    Counted& operator*=(Counted b) { return *this = *this * b; }
    Counted& operator/=(Counted b) { return *this = *this / b; }

    friend bool operator<(Counted a, Counted b) { return compared(a, b), a.value_ < b.value_; }
    friend bool operator>(Counted a, Counted b) { return compared(a, b), a.value_ > b.value_; }
    friend bool operator<=(Counted a, Counted b) { return compared(a, b), a.value_ <= b.value_; }
    friend bool operator>=(Counted a, Counted b) { return compared(a, b), a.value_ >= b.value_; }
    friend bool operator==(Counted a, Counted b) { return compared(a, b), a.value_ == b.value_; }

    friend Counted square_root(Counted a) { return result(a, a, std::sqrt(a.value_), &Operations::roots); }
    friend bool isfinite(Counted a) { return std::isfinite(a.value_); }
    friend Counted abs(Counted a) { return {std::abs(a.value_), a.is_constant_}; }
    friend Counted sin(Counted a) { return result(a, a, std::sin(a.value_), &Operations::functions); }
    friend Counted cos(Counted a) { return result(a, a, std::cos(a.value_), &Operations::functions); }
    friend Counted atan2(Counted a, Counted b) {
        return result(a, b, std::atan2(a.value_, b.value_), &Operations::functions);
    }
    friend Counted hypot(Counted a, Counted b, Counted c) {
        return result(a, b, std::hypot(a.value_, b.value_, c.value_), &Operations::functions);
    }

private:
    constexpr Counted(double value, bool is_constant) : value_(value), is_constant_(is_constant) {}

    [[nodiscard]] bool is(double constant) const { return is_constant_ && value_ == constant; }

    /// Results that a compiler knows in advance cost nothing.
    static Counted result(Counted a, Counted b, double value, int Operations::*operation) {
        const bool is_constant = a.is_constant_ && b.is_constant_;
        if (!is_constant) ++(counts_->*operation);
        return {value, is_constant};
    }
    static void compared(Counted a, Counted b) {
        if (!a.is_constant_ || !b.is_constant_) ++counts_->comparisons;
    }

    inline static Operations nowhere_;
    inline static Operations* counts_ = &nowhere_;

    double value_;
    bool is_constant_;
};

}  // namespace experiments

// GLM calls this by its full name and must find it in its own namespace: include this file before GLM's.
namespace glm {
inline experiments::Counted sqrt(experiments::Counted a) { return square_root(a); }
}  // namespace glm
namespace experiments {
using glm::sqrt;
}  // namespace experiments

/// GLM checks whether it is a floating-point number; Sinew reads its rounding error.
template <>
class std::numeric_limits<experiments::Counted> : public std::numeric_limits<double> {
public:
    static constexpr experiments::Counted epsilon() {
        return experiments::Counted(numeric_limits<double>::epsilon());
    }
    static constexpr experiments::Counted infinity() {
        return experiments::Counted(numeric_limits<double>::infinity());
    }
};
