# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects every public function of the mathematics, with 2,000 seeded cases each including edge cases,
compared with 50 digits (mpmath): float64 to 1e-14 and float32 to 1e-5 of what is summed, unless a check says
why it allows more.

Rounding of the input counts as the function's error: results are compared with those for the input before it
was rounded. Edge cases are rotations by 0, nearly 0, 180 degrees and nearly 180 degrees, both signs of
quaternions, and translations of 0, 1e-25 and 1e12.
"""

import inspect

import exact_interpolation
import exact_transforms
import pytest
import sinew

MODULES = ("affine", "quat_vec", "dual_quat", "quat", "dual", "interpolate", "spline")
METHODS = {
    "interpolate.between": sinew.interpolate.METHODS,
    "interpolate.blend": sinew.interpolate.METHODS,
    "spline.catmull_rom": sinew.interpolate.METHODS,
}
CHECKS = {**exact_transforms.CHECKS, **exact_interpolation.CHECKS}


def public_functions():
    """The functions of these modules, by "module.function"."""
    found = {
        f"{module}.{name}": getattr(getattr(sinew, module), name)
        for module in MODULES
        for name in dir(getattr(sinew, module))
        if not name.startswith("_")
    }
    return {name: what for name, what in found.items() if inspect.isroutine(what)}


FUNCTIONS = public_functions()


def names():
    """Includes the method for functions that have several."""
    return [
        f"{name}.{method}" if method else name for name in FUNCTIONS for method in METHODS.get(name, ("",))
    ]


def test_no_check_is_left_over():
    assert CHECKS.keys() == set(names())


@pytest.mark.parametrize("name", names())
def test_agrees_with_50_digits(name):
    assert name in CHECKS, f"{name} has no oracle: add its check to CHECKS of one of exact_*.py"
    module, function = name.split(".")[:2]
    CHECKS[name](module, FUNCTIONS[f"{module}.{function}"])
