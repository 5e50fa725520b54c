# SPDX-License-Identifier: GPL-3.0-or-later
"""Dual numbers real + e dual, e^2 = 0 (Clifford 1873; Smith 2013, section 2.2.3).

Layout: [.., 2] as (real, dual). Sums and differences are those of the arrays. A function of a dual number is
f(real) + e dual f'(real), so with dual = 1 the dual part is the derivative.

All functions accept one number or many: leading axes broadcast as in numpy. The result is float32 if all
arrays in a call are float32 or smaller, float64 otherwise. ValueError names the argument, what was expected
and what was given; NaN and infinity are refused.
"""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ._native import dual as _native

__all__ = ["conjugate", "cos", "divide", "exp", "log", "multiply", "sin", "sqrt"]


def multiply(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """a b: (real a real b, real a dual b + dual a real b)."""
    return _native.multiply(a, b)


def divide(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """a / b. ValueError if a real part of `b` is 0: such a number has no inverse."""
    return _native.divide(a, b)


def conjugate(a: ArrayLike) -> NDArray[Any]:
    """The conjugate: real - e dual."""
    return _native.conjugate(a)


def sqrt(a: ArrayLike) -> NDArray[Any]:
    """The square root with a positive real part. ValueError if the real part of `a` is not positive."""
    return _native.sqrt(a)


def sin(a: ArrayLike) -> NDArray[Any]:
    """The sine, radians: for example of a screw's angle and length."""
    return _native.sin(a)


def cos(a: ArrayLike) -> NDArray[Any]:
    """The cosine, radians."""
    return _native.cos(a)


def exp(a: ArrayLike) -> NDArray[Any]:
    """The exponential."""
    return _native.exp(a)


def log(a: ArrayLike) -> NDArray[Any]:
    """The natural logarithm. ValueError if the real part of `a` is not positive."""
    return _native.log(a)
