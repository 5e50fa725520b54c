# SPDX-License-Identifier: GPL-3.0-or-later
"""Random transforms in the three layouts, from scipy, with which sinew's mathematics is compared."""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

LAYOUT_OF = {
    "matrix_linear": "affine",
    "matrix_polar": "affine",
    "matrix_log": "affine",
    "qv_nlerp": "quat_vec",
    "qv_slerp": "quat_vec",
    "dlb": "dual_quat",
    "sclerp": "dual_quat",
    "dib": "dual_quat",
}


def close(got, wanted, tolerance=1e-13):
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance)


def rigid(rng, count=None, extent=2.0):
    """A RigidTransform of scipy, one or `count`."""
    translation = rng.uniform(-extent, extent, 3 if count is None else (count, 3))
    return RigidTransform.from_components(translation, Rotation.random(count, rng=rng))


def layout(transform, name, dtype=np.float64):
    """scipy's RigidTransform in a layout of sinew, converted without sinew."""
    if name == "affine":
        array = transform.as_matrix()
    elif name == "quat_vec":
        array = np.concatenate(
            [transform.rotation.as_quat(scalar_first=True), transform.translation], axis=-1
        )
    else:
        array = transform.as_dual_quat(scalar_first=True)
    return np.asarray(array, dtype)


def matrix(array, name):
    """float64 [.., 4, 4] from a layout of sinew, by scipy, which also makes it rigid."""
    array = np.asarray(array, np.float64)
    if name == "affine":
        return array
    flat = array.reshape(-1, array.shape[-1])
    if name == "quat_vec":
        rotation = Rotation.from_quat(flat[:, :4], scalar_first=True)
        result = RigidTransform.from_components(flat[:, 4:], rotation).as_matrix()
    else:
        result = RigidTransform.from_dual_quat(flat, scalar_first=True).as_matrix()
    return result.reshape(*array.shape[:-1], 4, 4)
