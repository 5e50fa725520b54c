// SPDX-License-Identifier: GPL-3.0-or-later
#include "sinew/skinning/methods.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace sinew {
namespace {

TEST(Methods, names_numbers_labels_and_ids_are_unique) {
    std::set<std::string_view> names;
    std::set<std::string_view> labels;
    std::set<int> numbers;
    std::set<MethodId> ids;
    for (const Method& method : kMethods) {
        names.insert(method.name);
        labels.insert(method.label);
        numbers.insert(method.number);
        ids.insert(method.id);
    }
    EXPECT_EQ(names.size(), kMethods.size());
    EXPECT_EQ(labels.size(), kMethods.size());
    EXPECT_EQ(numbers.size(), kMethods.size());
    EXPECT_EQ(ids.size(), kMethods.size());
}

// .blend files hold these numbers: a change here changes people's files.
TEST(Methods, stored_numbers_stay) {
    EXPECT_EQ(find_method("lbs")->number, 1);
    EXPECT_EQ(find_method("qv")->number, 2);
    EXPECT_EQ(find_method("dq")->number, 3);
}

TEST(Methods, every_field_says_something) {
    for (const Method& method : kMethods) {
        EXPECT_GT(method.number, 0) << method.name;
        EXPECT_FALSE(method.name.empty());
        EXPECT_FALSE(method.label.empty()) << method.name;
        EXPECT_FALSE(method.description.empty()) << method.name;
        EXPECT_FALSE(method.needs.empty()) << method.name;
    }
}

TEST(Methods, find_method_finds_every_row) {
    for (const Method& method : kMethods) {
        ASSERT_TRUE(find_method(method.name)) << method.name;
        EXPECT_EQ(find_method(method.name)->id, method.id);
    }
}

TEST(Methods, find_method_finds_no_other) {
    for (const std::string_view name : {"", "LBS", "lb", "lbs ", "nothing"}) {
        EXPECT_FALSE(find_method(name)) << name;
    }
}

}  // namespace
}  // namespace sinew
