// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "sinew/stages/mix/mix.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace sinew {

/// The only list of stages, in the order in which they run after a method.
inline constexpr std::array kStages{Mix::info, TwistSpreadStage::info, BulgeLimitStage::info,
                                    DeltaMushStage::info};

}  // namespace sinew
