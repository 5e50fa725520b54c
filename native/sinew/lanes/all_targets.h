// SPDX-License-Identifier: GPL-3.0-or-later
// Has the file SINEW_THIS_FILE, which includes this, compiled once for each instruction set: foreach_target.h includes
// that file again. Without a guard, as each file that is compiled so includes it.
#include "sinew/base/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE SINEW_THIS_FILE
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
