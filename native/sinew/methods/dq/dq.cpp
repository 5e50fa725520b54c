// SPDX-License-Identifier: GPL-3.0-or-later
// Dual quaternion skinning on lanes. A row is the real part and the dual part, each (w, x, y, z).
// This file is compiled once for each instruction set by including itself (foreach_target.h).
#include "sinew/methods/dq/dq.h"

#include "sinew/base/targets.h"
#include "sinew/lanes/rigid_bones.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sinew/methods/dq/dq.cpp"
#include "hwy/foreach_target.h"
//
#include "hwy/highway.h"
#include "sinew/lanes/bones-inl.h"
#include "sinew/lanes/dual-inl.h"
#include "sinew/lanes/rigid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sinew {
namespace HWY_NAMESPACE {
namespace {

SINEW_RIGID_FUNCTIONS(DqKernel)

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sinew
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sinew {
namespace {

constexpr Float4 kRestRow[] = {{{1, 0, 0, 0}}, {{0, 0, 0, 0}}};

void write_bone(const Dq::Bone<double>& bone, Float4* row, Float4* scale) {
    row[0] = float4(bone.rigid.real);
    row[1] = float4(bone.rigid.dual);
    write_displacement(bone.scale, scale);
}

}  // namespace

SINEW_KERNEL(Dq, .rest_row = kRestRow, .bone_rows = SINEW_TARGETS(bone_rows),
             .scaled_bone_rows = scaled_bone_rows<Dq, 2, write_bone>)

}  // namespace sinew
#endif
