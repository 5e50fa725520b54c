// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skinning/methods.h"

#include <gtest/gtest.h>

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
    EXPECT_EQ(index_of(MethodInfo{1000, "lbs", "", MethodGroup::blender, "", "", Needs::nothing}), kMethodCount);
}

// A property can be made of each parameter.
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
    for (const MethodInfo& method : kMethods) check(method.name, method.parameters);
    for (const StageInfo& stage : kStages) {
        EXPECT_FALSE(stage.label.empty() || stage.description.empty()) << stage.name;
        check(stage.name, stage.parameters);
    }
}

}  // namespace
}  // namespace sinew
