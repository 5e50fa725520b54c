# SPDX-License-Identifier: GPL-3.0-or-later
"""Dual numbers real + e dual, e^2 = 0 (Clifford 1873; Smith 2013, section 2.2.3).

Layout: [.., 2] as (real, dual). Sums and differences are those of the arrays. A function of one is f(real) +
e dual f'(real): with dual = 1 the dual part is the derivative.

Every function takes one or many: leading axes broadcast as numpy's do. The result is float32 where all arrays
of a call are of float32 or less, float64 otherwise. ValueError names the argument, what was wanted and what
came; NaN and infinity are refused.
"""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from ._native import dual as _native

__all__ = ["conjugate", "cos", "divide", "exp", "log", "multiply", "sin", "sqrt"]


def multiply(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """a b: (real a real b, real a dual b + dual a real b)."""
    return _native.multiply(a, b)


def divide(a: ArrayLike, b: ArrayLike) -> NDArray[Any]:
    """a / b. ValueError where a real part of `b` is 0: it has no inverse."""
    return _native.divide(a, b)


def conjugate(a: ArrayLike) -> NDArray[Any]:
    """real - e dual."""
    return _native.conjugate(a)


def sqrt(a: ArrayLike) -> NDArray[Any]:
    """The square root with a real part above 0. ValueError where the real part of `a` is not above 0."""
    return _native.sqrt(a)


def sin(a: ArrayLike) -> NDArray[Any]:
    """The sine, radians: of an angle and a length, as of a screw."""
    return _native.sin(a)


def cos(a: ArrayLike) -> NDArray[Any]:
    """The cosine, radians."""
    return _native.cos(a)


def exp(a: ArrayLike) -> NDArray[Any]:
    """The exponential."""
    return _native.exp(a)


def log(a: ArrayLike) -> NDArray[Any]:
    """The natural logarithm. ValueError where the real part of `a` is not above 0."""
    return _native.log(a)
