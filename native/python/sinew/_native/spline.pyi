from __future__ import annotations
import numpy.typing
import sinew._types
import sinew.interpolate
import typing
__all__: list[str] = ['catmull_rom', 'catmull_rom_vector']
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
