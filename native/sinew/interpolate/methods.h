// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tuple>

#include "sinew/interpolate/dual.h"
#include "sinew/interpolate/log_matrix.h"

namespace sinew {

/// All interpolation methods. The Python package, the tests and the experiments read this list.
using Interpolations = std::tuple<MatrixLinear, MatrixPolar, MatrixLog, QvNlerp, QvSlerp, Dlb, Sclerp, Dib>;

}  // namespace sinew
