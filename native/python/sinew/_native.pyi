from types import ModuleType
from typing import Literal, final, overload

import numpy as np
from numpy.typing import NDArray

from ._types import Float

__version__: str

# Typed and described in the modules of the package that have these names.
affine: ModuleType
dual_quat: ModuleType
interpolate: ModuleType
quat_vec: ModuleType
spline: ModuleType

@final
class Parameter:
    @property
    def id(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def kind(self) -> Literal["float", "int", "bool", "enum", "vertex_group", "method"]: ...
    @property
    def default(self) -> float | int | bool | str | None: ...
    @property
    def min(self) -> float | None: ...
    @property
    def max(self) -> float | None: ...
    @property
    def choices(self) -> tuple[str, ...]: ...

@final
class Method:
    @property
    def number(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def needs(self) -> tuple[str, ...]: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

@final
class Stage:
    @property
    def name(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

def methods() -> tuple[Method, ...]: ...
def stages() -> tuple[Stage, ...]: ...
def keep_thread_state() -> None: ...

@final
class Skeleton:
    def __init__(self, parents: NDArray[np.int32]) -> None: ...
    @property
    def bone_count(self) -> int: ...
    def root_relative(self, transforms: NDArray[Float]) -> NDArray[Float]: ...
    def interpolate(
        self, a: NDArray[Float], b: NDArray[Float], t: float, method: str = "dlb"
    ) -> tuple[NDArray[Float], bool]: ...
    def spline(
        self, keyframes: NDArray[Float], times: NDArray[Float], time: float, method: str = "dlb"
    ) -> tuple[NDArray[Float], bool]: ...
    def spline_vector(
        self, keyframes: NDArray[Float], times: NDArray[Float], time: float
    ) -> tuple[NDArray[Float], bool]: ...

@final
class Binding:
    """A mesh bound to bones: immutable, and shared by the deformers made of it."""

    def __init__(
        self,
        rest_points: NDArray[np.float32],
        influence_offsets: NDArray[np.int32],
        influence_bones: NDArray[np.int32],
        influence_weights: NDArray[np.float32],
        rest_bones: NDArray[np.float32] | None = None,
    ) -> None: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def influence_count(self) -> int: ...
    @property
    def bone_count(self) -> int: ...

@final
class Deformer:
    """A binding and a method, ready to deform at any pose.

    mix  None, or (method, weights): the share of another method, float32 [vertices] from 0 to 1, that each
         vertex takes (the stage `mix`)
    """

    @overload
    def __init__(
        self,
        binding: Binding,
        method: str = "lbs",
        mix: tuple[str, NDArray[np.float32]] | None = None,
    ) -> None: ...
    @overload
    def __init__(
        self,
        rest_points: NDArray[np.float32],
        influence_offsets: NDArray[np.int32],
        influence_bones: NDArray[np.int32],
        influence_weights: NDArray[np.float32],
        method: str = "lbs",
        rest_bones: NDArray[np.float32] | None = None,
    ) -> None: ...
    @property
    def method(self) -> str: ...
    @property
    def mixed_method(self) -> str | None: ...
    @property
    def vertex_count(self) -> int: ...
    @property
    def influence_count(self) -> int: ...
    @property
    def bone_count(self) -> int: ...
    def set_rest_points(self, rest_points: NDArray[np.float32]) -> None: ...
    def deform(
        self,
        bone_transforms: NDArray[np.float32],
        out: NDArray[np.float32] | None = None,
        threads: int | None = None,
        bones_from_model: NDArray[np.float32] | None = None,
        rest_inverses: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float32]: ...
