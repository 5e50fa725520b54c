// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/skinning/bulge_limit.h"
#include "sinew/skinning/delta_mush.h"
#include "sinew/skinning/mix.h"

namespace sinew {

/// The only list of stages, in the order in which they run after a method.
inline constexpr std::array kStages{Mix::info, BulgeLimitStage::info, DeltaMushStage::info};

}  // namespace sinew
