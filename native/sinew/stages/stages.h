// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "sinew/stages/bulge_limit/bulge_limit.h"
#include "sinew/stages/delta_mush/delta_mush.h"
#include "sinew/stages/mix/mix.h"
#include "sinew/stages/twist_spread/twist_spread.h"

namespace sinew {

// The only list of stages, by their definitions, in the order in which they run after a method.
#define SINEW_STAGES(each) \
    each(Mix) each(TwistSpreadDefinition) each(BulgeLimitDefinition) each(DeltaMushDefinition)

/// The facts about each stage, in the order of the list.
#define SINEW_INFO(Stage) Stage::info,
inline constexpr std::array kStages{SINEW_STAGES(SINEW_INFO)};
#undef SINEW_INFO

}  // namespace sinew
