// SPDX-License-Identifier: GPL-3.0-or-later
// All that the library has.
#pragma once

#include "sinew/base/simd.h"
#include "sinew/base/thread_pool.h"
#include "sinew/bulge_limit.h"
#include "sinew/deformer.h"
#include "sinew/delta_mush.h"
#include "sinew/fit/average.h"
#include "sinew/fit/hand_eye.h"
#include "sinew/fit/rigid.h"
#include "sinew/ik/solver.h"
#include "sinew/interpolate/hermite.h"
#include "sinew/interpolate/methods.h"
#include "sinew/interpolate/spline.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#include "sinew/methods/methods.h"
#include "sinew/normals.h"
#include "sinew/skeleton/forward_kinematics.h"
#include "sinew/skeleton/keyframes.h"
#include "sinew/skinned_normals.h"
#include "sinew/stages/stages.h"
#include "sinew/transform/make.h"
#include "sinew/transform/rigid_distance.h"
#include "sinew/transform/screw.h"
#include "sinew/twist_spread.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif
