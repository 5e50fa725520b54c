// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace sinew {

/// Throws std::invalid_argument "`argument`: expected `wanted`, got `got`".
[[noreturn]] inline void fail(const std::string& argument, const std::string& wanted,
                              const std::string& got) {
    throw std::invalid_argument(argument + ": expected " + wanted + ", got " + got);
}

}  // namespace sinew
