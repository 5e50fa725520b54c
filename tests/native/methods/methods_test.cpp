// SPDX-License-Identifier: GPL-3.0-or-later
// Protects the lookup of methods, and values of parameters, which become valid.
#include "sinew/methods/methods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string_view>

namespace sinew {
namespace {

TEST(Methods, have_parameters_that_a_frame_can_take) {
    for (const MethodInfo& method : kMethods) {
        EXPECT_LE(method.parameters.size(), kMaxMethodParameters) << method.name;
        for (const Parameter& parameter : method.parameters) {
            EXPECT_TRUE(is_numeric(parameter.kind) || parameter.kind == ParameterKind::choice)
                << method.name << parameter.id;
        }
    }
}

TEST(Methods, values_of_parameters_become_valid) {
    using enum ParameterKind;
    const double nan = std::nan("");
    const double inf = std::numeric_limits<double>::infinity();
    const Parameter share{"share", "Share", "", "", number, 0.25, 0.0, 1.0};
    EXPECT_EQ(valid_value(share, 0.5), 0.5);
    EXPECT_EQ(valid_value(share, -3.0), 0.0);
    EXPECT_EQ(valid_value(share, inf), 1.0);
    EXPECT_EQ(valid_value(share, nan), 0.25);
    const Parameter count{"count", "Count", "", "", integer, 2.0, 1.0, 9.0};
    EXPECT_EQ(valid_value(count, 3.6), 4.0);
    EXPECT_EQ(valid_value(count, 100.0), 9.0);
    const Parameter is_on{"on", "On", "", "", boolean, 1.0};
    EXPECT_EQ(valid_value(is_on, 0.0), 0.0);
    EXPECT_EQ(valid_value(is_on, -2.0), 1.0);
    static constexpr std::string_view kChoices[] = {"a", "b", "c"};
    const Parameter one{.id = "one",
                        .label = "",
                        .description = "",
                        .unit = "",
                        .kind = choice,
                        .initial = 1.0,
                        .choices = kChoices};
    EXPECT_EQ(valid_value(one, 1.6), 2.0);
    EXPECT_EQ(valid_value(one, 7.0), 2.0);
    EXPECT_EQ(valid_value(one, -inf), 0.0);
    EXPECT_EQ(valid_value(one, nan), 1.0);
}

}  // namespace
}  // namespace sinew
