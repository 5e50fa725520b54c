// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the counts of operations that the report's tables print.
// Must be included before all others, see there.
#include "experiments/operation_counts.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace experiments {
namespace {

std::map<std::string, Operations> by_name() {
    std::map<std::string, Operations> result;
    for (const OperationCount& count : operation_counts()) {
        result[std::string(count.table) + " " + std::string(count.name)] = count.operations;
    }
    return result;
}

/// Additions including doublings, as the report counts them, and multiplications.
std::pair<int, int> as_report(const Operations& o) { return {o.additions + o.doublings, o.multiplications}; }

TEST(Counted, CountsEachKindOnce) {
    Operations o;
    const Counted::CountIn counting(o);
    const Counted x = Counted::input(2.0);
    const Counted y = Counted::input(3.0);
    EXPECT_EQ((x * y + y / x - sqrt(x)).value(), 6.0 + 1.5 - std::sqrt(2.0));
    EXPECT_EQ((Counted(2) * x).value(), 4.0);
    EXPECT_EQ((-x).value(), -2.0);
    EXPECT_TRUE(x < y);
    EXPECT_EQ(o.additions, 2);
    EXPECT_EQ(o.multiplications, 1);
    EXPECT_EQ(o.divisions, 1);
    EXPECT_EQ(o.roots, 1);
    EXPECT_EQ(o.doublings, 1);
    EXPECT_EQ(o.negations, 1);
    EXPECT_EQ(o.comparisons, 1);
    EXPECT_EQ(o.total(), 6);
}

TEST(Counted, ConstantsCostNothingButWhatTheyDoToOthers) {
    Operations o;
    const Counted::CountIn counting(o);
    const Counted x = Counted::input(0.0);  // a 0 that is not a constant in the source
    EXPECT_EQ((Counted(1) * x + Counted(0) - Counted(0) * x).value(), 0.0);
    EXPECT_EQ((Counted(3) * Counted(5) + Counted(0.5)).value(), 15.5);
    EXPECT_EQ(o.total(), 0);
    static_cast<void>(x * x + x);
    EXPECT_EQ(o.total(), 2);
}

TEST(OperationCounts, Table3_2) {
    const auto counts = by_name();
    EXPECT_EQ(as_report(counts.at("3.2 affine")), std::pair(9, 9));      // as printed
    EXPECT_EQ(as_report(counts.at("3.2 quat_vec")), std::pair(18, 15));  // as printed
    EXPECT_EQ(as_report(counts.at("3.2 dual_quat")), std::pair(33, 31));
    EXPECT_EQ(as_report(counts.at("3.2 dual_quat_by_products")), std::pair(52, 60));
    EXPECT_EQ(as_report(counts.at("3.2 matrix_4x4")), std::pair(12, 16));
}

TEST(OperationCounts, Table3_3) {
    const auto counts = by_name();
    EXPECT_EQ(as_report(counts.at("3.3 affine")), std::pair(27, 36));    // as printed
    EXPECT_EQ(as_report(counts.at("3.3 quat_vec")), std::pair(30, 31));  // as printed
    EXPECT_EQ(as_report(counts.at("3.3 dual_quat")), std::pair(40, 48));
    EXPECT_EQ(as_report(counts.at("3.3 matrix_4x4")), std::pair(48, 64));
}

TEST(OperationCounts, BlendsOfThreeAtAPoint) {
    const auto counts = by_name();
    EXPECT_EQ(counts.at("3.10 lbs").total(), 81);
    EXPECT_EQ(counts.at("3.10 qv").total(), 95);
    EXPECT_EQ(counts.at("3.10 dq").total(), 123);
}

}  // namespace
}  // namespace experiments
