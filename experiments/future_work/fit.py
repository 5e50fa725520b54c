# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid transforms fitted to measurements: to points and directions, to motions, to many poses.

All functions accept one problem or many: the axes before the last ones of each argument broadcast as in
numpy. All computation is in float64. `is_defined` says whether the result is the only best one; if not, it is
one of the best, finite. Negative weights are refused.
"""

from future_work_native.fit import average, hand_eye, rigid

from .types import Averaged, HandEye, RigidFit

__all__ = ["Averaged", "HandEye", "RigidFit", "average", "hand_eye", "rigid"]
