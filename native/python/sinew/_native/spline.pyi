from __future__ import annotations
import numpy.typing
import sinew._types
import sinew.interpolate
import typing
__all__: list[str] = ['catmull_rom', 'catmull_rom_vector', 'hermite']
def catmull_rom(keys: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, at: numpy.typing.ArrayLike, method: sinew.interpolate.Method = 'dlb') -> sinew._types.Blended[typing.Any]:
    """Blend form: the keys blended by `method` with the weights of the spline (Smith 2013, section 3.2.2).

    Rigid for every method except matrix_linear. The keys are in the layout of the method.

    If keys are more than about 100 degrees apart, the negative weights may keep the iterations of qv_slerp and dib
    from converging: the result is then not defined, finite, and may jump.
    """
def catmull_rom_vector(keys: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, at: numpy.typing.ArrayLike) -> sinew._types.Blended[typing.Any]:
    """Vector form: the components as a vector of 12, 7, 8 or, for points, 3 numbers (Smith 2013, algorithm
    3).

    Rigid only at the keys; the layout's normalized() makes it rigid everywhere.
    """
def hermite(keys: numpy.typing.ArrayLike, tangents: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, at: numpy.typing.ArrayLike) -> sinew._types.Blended[typing.Any]:
    """The cubic Hermite spline through keys with arbitrary tangents (Smith 2013, section 2.3.2).

    keys: [n, 3], points, or [n, 8], rigid transforms.
    tangents: for a unit of time. Of points [n, 3]. Of transforms [n, 6], twists in each key's own axes: after a
        short time h the curve is compose(key, from_twist(h * tangent)).

    For transforms it is a Bezier curve whose chords are screws (Shoemake 1985, for quaternions): rigid throughout.
    Not defined where "sclerp" is not defined between two of its control poses.
    """
