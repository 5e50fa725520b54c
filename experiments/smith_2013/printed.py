# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers printed in Smith 2013, chapter 3; rows in the order matrices, pairs, dual quaternions."""

from __future__ import annotations

NAMES = {
    "affine": "Rigid transformation matrices",
    "quat_vec": "Quaternion-vector pair",
    "dual_quat": "Unit dual quaternions",
}

# Table 3.1: numbers to store.
MEMORY = {"affine": 12, "quat_vec": 7, "dual_quat": 8}

# Tables 3.2 and 3.3: adds, multiplies, total.
POINT_OPERATIONS = {"affine": (9, 9, 18), "quat_vec": (18, 15, 33), "dual_quat": (47, 45, 92)}
CHAIN_OPERATIONS = {"affine": (27, 36, 63), "quat_vec": (30, 31, 62), "dual_quat": (48, 36, 84)}

# Tables 3.4, 3.5, 3.9 and 3.10: mean seconds.
CHAIN_SECONDS = {"affine": 1.64, "quat_vec": 0.31, "dual_quat": 0.17}
POINT_SECONDS = {"affine": 1.43, "quat_vec": 0.47, "dual_quat": 1.11}
INTERPOLATION_SECONDS = {
    "matrix_linear": 2.98,
    "qv_nlerp": 0.97,
    "qv_slerp": 1.30,
    "dlb": 1.02,
    "sclerp": 2.05,
}
SKINNING_SECONDS = {"lbs": 4.51, "qv": 1.47, "dq": 2.18}

# Table 3.6: the point (0, 0, 0) after a rotation about (0, 1, 1) by 80 degrees and a translation by (1, 0,
# 0.5).
TRANSLATION = (80, (0, 1, 1), (1, 0, 0.5))
TRANSLATED = {
    "affine": (1.0, 0.0, 0.5),
    "quat_vec": (1.0, 0.0, 0.5),
    "dual_quat": (1.00000012, -0.00000003, 0.5),
}

# Table 3.7: angle in degrees, axis and translation of transforms A to D, and the position of (0, 0, 0) after
# each.
CHAIN = {
    "A": (70, (-0.089, 0.445, -0.89), (2, 2, 2)),
    "B": (70, (-0.667, -0.333, -0.667), (0, -2, -0.5)),
    "C": (170, (0.707, -0.707, 0), (10, -1, -4)),
    "D": (10, (0.707, 0, 0.707), (0, 0, 1)),
}
ONE_BY_ONE = {
    "affine": (
        (2.0, 2.0, 2.0),
        (2.7737715, -0.5859429, 1.0187607),
        (10.4774714, -3.8822441, -4.7346449),
        (10.8386106, -1.9554013, -4.0957837),
    ),
    "quat_vec": (
        (2.0, 2.0, 2.0),
        (2.7739086, -0.5862051, 1.0187545),
        (10.4777184, -3.8823950, -4.7346096),
        (10.8388376, -1.9558195, -4.0957294),
    ),
    "dual_quat": (
        (2.0000005, 2.0000007, 2.0000002),
        (2.7739096, -0.5862050, 1.0187547),
        (10.4777203, -3.8823957, -4.7346106),
        (10.8388424, -1.9558202, -4.0957308),
    ),
}

# Table 3.8: the same with one combined transform.
COMBINED = {
    "affine": (10.8386087, -1.9554017, -4.0957837),
    "quat_vec": (10.8388386, -1.9558198, -4.0957308),
    "dual_quat": (10.8388443, -1.9558202, -4.0957317),
}

# Figures 3.4 and 3.5: angle in degrees, axis and translation of the two ends.
ENDS = ((30, (0, 1, 0), (2, 0.5, 1)), (170, (0.707, -0.707, 0), (10, -1, -4)))

# Section 3.5.2, after Kavan et al. 2006: ScLERP and DLB differ by at most this angle, in degrees, and this
# share of the translation.
DLB_BOUND = (8.15, 0.15)
