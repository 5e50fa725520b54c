// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/skinning/delta_mush.h"
#include "sinew/skinning/mix.h"

namespace sinew {

/// THE list of stages: what may follow a method, in the order in which they do.
inline constexpr std::array kStages{Mix::info, DeltaMushStage::info};

}  // namespace sinew
