// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/skinning/mix.h"

namespace sinew {

/// THE list of stages: what may follow a method.
inline constexpr std::array kStages{Mix::info};

}  // namespace sinew
