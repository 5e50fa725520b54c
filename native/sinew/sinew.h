// SPDX-License-Identifier: GPL-3.0-or-later
// All that the library has.
//
// What holds for all of it: A constructor throws std::invalid_argument that names the argument, what was expected and
// what was given; sizes that do not match and values that are not finite are always refused. It keeps no reference to
// its arguments. A constructed object is valid; one that was moved from can only be assigned to or destroyed. Functions
// that run each frame throw nothing and return a Status, or what their header calls not defined. They do not allocate,
// except at the first of calls whose header says so. Concurrent calls on one object wait for each other, except
// those of a Deformer. `threads` is how many are used at most, 0: as many as useful; the result is the same bit for bit.
#pragma once

#include "sinew/base/simd.h"
#include "sinew/base/status.h"
#include "sinew/base/thread_pool.h"
#include "sinew/deformer.h"
#include "sinew/interpolate/methods.h"
#include "sinew/interpolate/spline.h"
#include "sinew/mesh/crossings.h"
#include "sinew/methods/cor/centres_of_rotation.h"
#include "sinew/methods/methods.h"
#include "sinew/normals.h"
#include "sinew/pose/continued_rotations.h"
#include "sinew/skinned_normals.h"
#include "sinew/stages/stages.h"
#include "sinew/transform/make.h"
#include "sinew/transform/rigid_distance.h"
#include "sinew/transform/screw.h"
#if SINEW_WITH_DDM
#include "sinew/methods/ddm/direct_delta_mush.h"
#endif
