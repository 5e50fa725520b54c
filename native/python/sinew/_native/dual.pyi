from __future__ import annotations
import numpy.typing
import typing
__all__: list[str] = ['conjugate', 'cos', 'divide', 'exp', 'log', 'multiply', 'sin', 'sqrt']
def conjugate(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The conjugate: real - e dual."""
def cos(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The cosine, radians."""
def divide(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """a / b. ValueError if a real part of `b` is 0: such a number has no inverse."""
def exp(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The exponential."""
def log(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The natural logarithm. ValueError if the real part of `a` is not positive."""
def multiply(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """a b: (real a real b, real a dual b + dual a real b)."""
def sin(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The sine, radians: for example of a screw's angle and length."""
def sqrt(a: numpy.typing.ArrayLike) -> numpy.typing.NDArray[typing.Any]:
    """The square root with a positive real part. ValueError if the real part of `a` is not positive."""
