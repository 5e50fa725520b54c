from types import ModuleType
from typing import final

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
    def needs(self) -> str: ...

def methods() -> tuple[Method, ...]: ...
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
class Deformer:
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
