// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skinning/methods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string_view>

#include "sinew/skinning/stages.h"

namespace sinew {
namespace {

TEST(Methods, names_numbers_and_labels_are_unique) {
    std::set<std::string_view> names;
    std::set<std::string_view> labels;
    std::set<int> numbers;
    for (const MethodInfo& method : kMethods) {
        names.insert(method.name);
        labels.insert(method.label);
        numbers.insert(method.number);
    }
    EXPECT_EQ(names.size(), kMethods.size());
    EXPECT_EQ(labels.size(), kMethods.size());
    EXPECT_EQ(numbers.size(), kMethods.size());
}

// These numbers are stored in .blend files: never change them.
TEST(Methods, stored_numbers_stay) {
    EXPECT_EQ(find_method("lbs")->number, 1);
    EXPECT_EQ(find_method("qv")->number, 2);
    EXPECT_EQ(find_method("dq")->number, 3);
    EXPECT_EQ(find_method("log")->number, 4);
    EXPECT_EQ(find_method("cor")->number, 5);
    EXPECT_EQ(find_method("sbs")->number, 6);
    EXPECT_EQ(find_method("dib")->number, 7);
    EXPECT_EQ(find_method("sdef")->number, 8);
#if SINEW_WITH_DDM
    EXPECT_EQ(find_method("ddm")->number, 9);
#else
    EXPECT_FALSE(find_method("ddm"));
#endif
}

TEST(Methods, every_field_says_something) {
    for (const MethodInfo& method : kMethods) {
        EXPECT_GT(method.number, 0) << method.name;
        EXPECT_FALSE(method.name.empty());
        EXPECT_FALSE(method.label.empty()) << method.name;
        EXPECT_FALSE(method.description.empty()) << method.name;
        EXPECT_FALSE(method.source.empty()) << method.name;
        EXPECT_EQ(method.vertex_floats > 0, has(method.needs, Needs::vertex_data)) << method.name;
    }
}

TEST(Methods, find_method_finds_every_row) {
    for (const MethodInfo& method : kMethods) {
        ASSERT_TRUE(find_method(method.name)) << method.name;
        EXPECT_EQ(*find_method(method.name), method);
        EXPECT_EQ(kMethods[index_of(method)].name, method.name);
    }
}

TEST(Methods, find_method_finds_no_other) {
    for (const std::string_view name : {"", "LBS", "lb", "lbs ", "nothing"}) {
        EXPECT_FALSE(find_method(name)) << name;
    }
    EXPECT_EQ(index_of(MethodInfo{1000, "lbs", "", MethodGroup::blender, "", "", Needs::nothing}),
              kMethodCount);
}

// Every parameter has all that a property in Blender needs.
TEST(Methods, parameters_are_whole) {
    const auto check = [](std::string_view owner, std::span<const Parameter> parameters) {
        std::set<std::string_view> ids;
        for (const Parameter& parameter : parameters) {
            EXPECT_TRUE(ids.insert(parameter.id).second) << owner;
            EXPECT_FALSE(parameter.label.empty() || parameter.description.empty()) << owner << parameter.id;
            EXPECT_EQ(parameter.choices.empty(), parameter.kind != ParameterKind::choice) << parameter.id;
            if (!is_numeric(parameter.kind)) continue;
            EXPECT_LE(parameter.minimum, parameter.initial) << owner << parameter.id;
            EXPECT_GE(parameter.maximum, parameter.initial) << owner << parameter.id;
        }
    };
    for (const MethodInfo& method : kMethods) {
        check(method.name, method.parameters);
        EXPECT_LE(method.parameters.size(), kMaxMethodParameters) << method.name;
        for (const Parameter& parameter : method.parameters) {
            EXPECT_TRUE(is_numeric(parameter.kind) || parameter.kind == ParameterKind::choice)
                << method.name << parameter.id;
        }
    }
    for (const StageInfo& stage : kStages) {
        EXPECT_FALSE(stage.label.empty() || stage.description.empty()) << stage.name;
        check(stage.name, stage.parameters);
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
