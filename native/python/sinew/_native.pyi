from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any, Literal, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

# Typed and described in the modules of the package that have these names.
affine: ModuleType
dual: ModuleType
dual_quat: ModuleType
fit: ModuleType
ik: ModuleType
interpolate: ModuleType
quat: ModuleType
quat_vec: ModuleType
spline: ModuleType

@final
class Parameter:
    """A setting of a method or of a stage."""

    @property
    def id(self) -> str:
        """The name in programs."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def description(self) -> str:
        """One sentence."""
    @property
    def unit(self) -> str:
        """One of "length", "angle" (radians) and "factor", or empty."""
    @property
    def kind(self) -> Literal["float", "int", "bool", "enum", "vertex_group", "method"]:
        """One of "float", "int", "bool", "enum" (one of `choices`), "vertex_group" (a weight for each vertex)
        and "method" (the name of a method)."""
    @property
    def default(self) -> float | int | bool | str | None:
        """The default; None for a vertex group and a method."""
    @property
    def min(self) -> float | None:
        """The smallest value of a number, -inf if there is no limit; None for other kinds."""
    @property
    def max(self) -> float | None:
        """The largest value of a number, inf if there is no limit; None for other kinds."""
    @property
    def choices(self) -> tuple[str, ...]:
        """The values of an enum."""

@final
class Method:
    """The facts about a skinning method."""

    @property
    def number(self) -> int:
        """The number that .blend files store. It never changes."""
    @property
    def name(self) -> str:
        """The name in programs."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def source(self) -> str:
        """The papers."""
    @property
    def group(self) -> str:
        """The heading of its group in menus."""
    @property
    def needs(self) -> tuple[str, ...]:
        """What it needs besides points, influences and bone transforms: "rest_bones", the bones' axes,
        where bones are scaled; "vertex_data", numbers for each vertex, an argument of Binding;
        "topology", triangles from which these are computed; "precomputation", a function that computes
        them."""
    @property
    def vertex_floats(self) -> int:
        """How many numbers its vertex data has for each vertex, or in each row; 0 if it has none."""
    @property
    def keeps_moments(self) -> bool:
        """Whether its vertex data is rows, any number for each vertex: see direct_delta_mush."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings, each a Parameter."""

@final
class Stage:
    """The facts about a stage. Stages run after a method."""

    @property
    def name(self) -> str:
        """The name in programs."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def source(self) -> str:
        """The papers."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings, each a Parameter."""

def methods() -> tuple[Method, ...]:
    """All skinning methods, each a Method."""

def stages() -> tuple[Stage, ...]:
    """All stages, each a Stage. `mix` is an argument of Deformer, `bulge_limit` is BulgeLimit,
    `delta_mush` is DeltaMush."""

def keep_thread_state() -> None:
    """Keeps Python's state of the calling thread until the thread ends. This makes calls from a thread
    that Python did not start, and that calls it often, 50 to 100 us faster. May be called again, and on
    any thread."""

def centres_of_rotation(
    rest_points: ArrayLike,
    influence_offsets: ArrayLike,
    influence_bones: ArrayLike,
    influence_weights: ArrayLike,
    triangles: ArrayLike,
    *,
    exact: bool = False,
    threads: int | None = None,
    progress: Callable[[float], object] | None = None,
) -> NDArray[np.float32] | None:
    """The vertex data of the method "cor": the optimised centre of rotation of each vertex, float32
    [vertices, 3], model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest
    points.

    rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
    triangles: int32 [triangles, 3], vertices.
    exact: compute by the definition itself, which is slow; otherwise triangles of similar weights are
    summed.
    threads: maximum number; None or 0: as many as useful. The result is the same bit for bit. They give
        way to all other threads.
    progress: None, or a callable that is called on this thread with the completed share, 0 to 1. If it
        returns False, the work is cancelled and the result is None. An exception that it raises is passed
        on.

    Precomputations of other methods have the same `threads` and `progress`. Releases the GIL.
    """

def direct_delta_mush(
    rest_points: ArrayLike,
    influence_offsets: ArrayLike,
    influence_bones: ArrayLike,
    influence_weights: ArrayLike,
    triangles: ArrayLike,
    radius: float,
    *,
    exact: bool = False,
    threads: int | None = None,
    progress: Callable[[float], object] | None = None,
) -> NDArray[np.float32] | None:
    """The vertex data of the method "ddm": the moments of each bone's smoothed weights around each vertex
    (Le, Lewis 2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight,
    first moment (x, y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of the
    vertex's first moments). Rows are in ascending order of vertices and, for each vertex, of bones. They
    belong to these rest points and this radius.

    rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
    triangles: int32 [triangles, 3], vertices.
    radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard deviation
        along each axis.
    exact: include weights below 1e-6, which are otherwise left out.
    threads, progress: as for centres_of_rotation. Releases the GIL.

    Raises RuntimeError if Sinew was built without this method.
    """

@final
class Skeleton:
    """A hierarchy of bones in which parents precede their children.

    Its methods take each bone relative to its parent, in any representation, with layouts as in
    sinew.affine, sinew.quat_vec and sinew.dual_quat, and promote arrays in the same way. They raise
    ValueError that names the argument, what was expected and what was given.
    """

    def __init__(self, parents: ArrayLike) -> None:
        """parents: int32 [bones], the index of each bone's parent, -1 for a root.

        Raises ValueError if a parent does not precede its child.
        """
    @property
    def bone_count(self) -> int:
        """Number of bones."""
    def root_relative(self, transforms: ArrayLike, root: ArrayLike | None = None) -> NDArray[Any]:
        """Each bone relative to the root, in the given representation (Smith 2013, algorithm 1).

        transforms: [bones, 4, 4] or [bones, 3, 4], for which the result is [bones, 4, 4]; [bones, 7];
            [bones, 8].
        root: None, or a transform that is applied after that of every bone without a parent.
        """
    def update_branch(
        self,
        root_relative: ArrayLike,
        transforms: ArrayLike,
        bone: int | np.integer[Any],
        root: ArrayLike | None = None,
    ) -> NDArray[Any]:
        """Updates root_relative() after a change of one bone: computes only that bone and its descendants.

        root_relative: the result of root_relative() before the change, in the representation of
        `transforms`.
        transforms, root: as for root_relative().
        bone: the index of the changed bone.
        """
    def interpolate(
        self, a: ArrayLike, b: ArrayLike, t: ArrayLike, method: str = "dlb"
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """(transforms, is_defined): the skeleton between two keyframes (Smith 2013, algorithm 2).

        a, b: [bones, ..] in the representation of the method, at t = 0 and t = 1.
        t: a number, or [..], for which the results are [.., bones, ..] and [..]; extrapolates outside 0 to
            1.
        method: one of sinew.interpolate.METHODS.
        is_defined: False if the result is not defined for some bone, which then has the result that
            sinew.interpolate.between specifies.
        """
    def spline(
        self, keyframes: ArrayLike, times: ArrayLike, time: ArrayLike, method: str = "dlb"
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """(transforms, is_defined): the skeleton on a Catmull-Rom spline through keyframes, in blend form
        (Smith 2013, algorithm 3 and section 3.2.2).

        keyframes: [keys, bones, ..] in the representation of the method, at least one key.
        times: [keys], non-decreasing; keys of equal time are a cut.
        time: a number, or [..], for which the results are [.., bones, ..] and [..]; constant before the
            first key and after the last.
        method: one of sinew.interpolate.METHODS.
        """
    def spline_vector(
        self, keyframes: ArrayLike, times: ArrayLike, time: ArrayLike
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """The same in vector form (Smith 2013, algorithm 3): not rigid between keys.

        keyframes: [keys, bones, 4, 4], [keys, bones, 3, 4], [keys, bones, 7] or [keys, bones, 8].
        """

@final
class Binding:
    """A mesh bound to bones. Immutable; the deformers made from it share its memory."""

    def __init__(
        self,
        rest_points: ArrayLike,
        influence_offsets: ArrayLike,
        influence_bones: ArrayLike,
        influence_weights: ArrayLike,
        rest_bones: ArrayLike | None = None,
        vertex_data: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """rest_points: float32 [vertices, 3], model space.
        influence_offsets: int32 [vertices + 1], the first influence of each vertex, then the end.
        influence_bones: int32 [influences].
        influence_weights: float32 [influences], >= 0, any sum (they are normalised).
            At most 2^31 - 1 vertices and influences, 65,536 influences for a vertex, 1,048,576 bones.
        rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], orthonormal, Y along the bone, in the space of
            the bone transforms. Read by sbs, and by other rigid methods where a bone is scaled. None:
            identity.
        vertex_data: a dict of the vertex data of methods, float32 [vertices, Method.vertex_floats] by the
            method's name: {"cor": sinew.centres_of_rotation(...)}. A method without its data falls back:
            under cor each vertex is its own centre, which is linear blending.

        Arrays may be anything that numpy converts to them without losing more than digits of fractions:
        lists, float64, int64 whose numbers fit. All input is copied. Raises ValueError that names the
        argument, what was expected and what was given. Can be pickled: the bound mesh, with normalised
        weights.
        """
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
    @property
    def influence_count(self) -> int:
        """Influences of positive weight."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone index in the influences."""

@final
class Deformer:
    """A binding and a method, ready to deform any pose.

    Can be pickled, with its current rest points and its own binding.
    """

    @overload
    def __init__(
        self,
        binding: Binding,
        method: str = "lbs",
        mix: tuple[str, ArrayLike] | None = None,
    ) -> None:
        """binding: a Binding; not copied.
        method: the name of one of sinew.methods().
        mix: None, or (name of another method, weights): weights float32 [vertices] are the share of the
            other method at each vertex, from 0 (none) to 1 (all); clamped. This is the stage `mix`.
        """
    @overload
    def __init__(
        self,
        rest_points: ArrayLike,
        influence_offsets: ArrayLike,
        influence_bones: ArrayLike,
        influence_weights: ArrayLike,
        method: str = "lbs",
        rest_bones: ArrayLike | None = None,
        vertex_data: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Constructs its own binding, from the arguments of Binding."""
    @property
    def method(self) -> str:
        """The name of the method."""
    @property
    def mixed_method(self) -> str | None:
        """The name of the method that `mix` adds, or None."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
    @property
    def influence_count(self) -> int:
        """Influences of positive weight."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone index in the influences."""
    def set_rest_points(self, rest_points: ArrayLike) -> None:
        """Sets the rest points of this deformer alone, float32 [vertices, 3], such as when shape keys
        change. Other threads may deform meanwhile: each of their results has either the old points or the
        new ones.
        """
    def deform(
        self,
        bone_transforms: ArrayLike,
        out: NDArray[np.float32] | None = None,
        threads: int | np.integer[Any] | None = None,
        bones_from_model: ArrayLike | None = None,
        rest_inverses: ArrayLike | None = None,
        parameters: Mapping[str, float | bool | str] | None = None,
    ) -> NDArray[np.float32]:
        """The deformed points, float32 [vertices, 3], model space.

        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest; a fourth row is not read.
        out: if given, written and returned: float32 [vertices, 3], C-contiguous, aligned; never converted.
        threads: maximum number; None or 0: as many as useful. The
            result is the same bit for bit.
        bones_from_model: float32 [4, 4] or [3, 4], maps model space to the space of the bone transforms,
            in which the bones are blended; the result is mapped back. None: the same space.
        rest_inverses: float64 [bones, 4, 4] or [bones, 3, 4]. If given, bone_transforms are the posed
            bones, and each is multiplied by the inverse of its rest transform, in double.
        parameters: a dict of values of methods' parameters by their full names, METHOD.PARAMETER, as
            described by Parameter; missing ones have their defaults. Parameters of methods that the
            deformer does not use have no effect.

        A vertex without influences is not moved. Releases the GIL for large meshes. Raises ValueError that
        names the argument, what was expected and what was given.
        """

@final
class BulgeLimit:
    """The stage `bulge_limit` for one mesh: moves deformed points back towards their bones where blending
    took them farther away than they are at rest (Kim, Han 2014, and a continuous form). Can be pickled.
    """

    def __init__(
        self,
        rest_points: ArrayLike,
        influence_offsets: ArrayLike,
        influence_bones: ArrayLike,
        influence_weights: ArrayLike,
        heads: ArrayLike,
        tails: ArrayLike,
        *,
        bones_from_model: ArrayLike | None = None,
        weights: ArrayLike | None = None,
    ) -> None:
        """rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
        heads, tails: float32 [bones, 3], the ends of each bone at rest, in the space of the bone
        transforms.
        bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same space.
        weights: None, or float32 [vertices], how much each vertex is limited, 0 to 1; clamped.

        All input is copied. Raises ValueError that names the argument, what was expected and what was
        given.
        """
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone index in the influences."""
    def set_rest_points(self, rest_points: ArrayLike, bones_from_model: ArrayLike | None = None) -> None:
        """Sets other rest points, float32 [vertices, 3], or another space of the bones: measures
        distances at rest again, which takes about as long as apply()."""
    def apply(
        self,
        points: ArrayLike,
        bone_transforms: ArrayLike,
        out: NDArray[np.float32] | None = None,
        *,
        strength: float = 1.0,
        form: str = "continuous",
        threads: int | np.integer[Any] | None = None,
    ) -> NDArray[np.float32]:
        """The limited points, float32 [vertices, 3], model space.

        points: float32 [vertices, 3], deformed, model space.
        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for Deformer.deform().
        out: if given, written and returned: float32 [vertices, 3], C-contiguous, aligned; never converted.
            May be `points`.
        strength: how much of the bulge is removed, 0 to 1.
        form: "continuous": distances to all bones of a vertex, weighted; "kim_han": only to the heaviest,
            which tears the surface where that changes.
        threads: maximum number; None or 0: as many as useful. The
            result is the same bit for bit.

        Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit for
        bit. A scaled bone allows a distance larger by the largest factor by which it stretches vectors
        perpendicular to it. Releases the GIL for large meshes. Raises ValueError that names the argument,
        what was expected and what was given.
        """

@final
class DeltaMush:
    """The stage `delta_mush` for one mesh: smooths deformed points and adds the details of the rest points
    back (Mancewicz et al. 2014), as Blender's Corrective Smooth does. Can be pickled.
    """

    def __init__(
        self,
        rest_points: ArrayLike,
        face_offsets: ArrayLike,
        corner_vertices: ArrayLike,
        edges: ArrayLike,
        *,
        iterations: int | np.integer[Any] = 5,
        radius: float = 0.0,
        factor: float = 0.5,
        smooth_type: str = "simple",
        pin_boundary: bool = False,
        weights: ArrayLike | None = None,
    ) -> None:
        """rest_points: float32 [vertices, 3], without shape keys.
        face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
        corner_vertices: int32 [corners], the vertex of each corner.
        edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces.
            At most 2^29 - 1 vertices.
        iterations: number of smoothing iterations, 0 to 1,000; not used with a radius.
        radius: how far the smoothing reaches, in units of the points, as the width of a Gaussian,
            independently of the density of the mesh; 0: use `iterations`. The shortest tenth of edges is
            smoothed less far, and so are all where this would take more than 1,000 iterations.
        factor: how far one iteration moves a vertex, 0 to 1.
        smooth_type: "simple", or "length_weighted": neighbours are weighted by the length of their edges.
        pin_boundary: whether vertices on edges with a single face are left as they are.
        weights: None, or float32 [vertices], how much each vertex is smoothed, 0 to 1; clamped.

        All input is copied. Raises ValueError that names the argument, what was expected and what was
        given.
        """
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
    @property
    def iterations(self) -> int:
        """Number of smoothing iterations, also if a radius determines it."""
    def bind(
        self,
        rest_points: ArrayLike,
        *,
        iterations: int | np.integer[Any] = 5,
        radius: float = 0.0,
        factor: float = 0.5,
        smooth_type: str = "simple",
        pin_boundary: bool = False,
        weights: ArrayLike | None = None,
    ) -> None:
        """Sets other rest points and settings for the same faces and edges, which takes about as long as
        apply().

        Takes the arguments of the constructor and raises ValueError as it does; the object is then
        unchanged.
        """
    def apply(
        self,
        points: ArrayLike,
        out: NDArray[np.float32] | None = None,
        scale: float = 1.0,
        threads: int | np.integer[Any] | None = None,
    ) -> NDArray[np.float32]:
        """The smoothed points, float32 [vertices, 3].

        points: float32 [vertices, 3], deformed, in the space of the rest points.
        out: if given, written and returned: float32 [vertices, 3], C-contiguous, aligned; never converted.
            May be `points`.
        scale: how much of the details is added back; 1: all.
        threads: maximum number; None or 0: as many as useful. The
            result is the same bit for bit.

        A vertex without faces is smoothed and has no details. Releases the GIL for large meshes. Raises
        ValueError that names the argument, what was expected and what was given.
        """

@final
class Normals:
    """Normals of a mesh that deforms, as Blender defines them: of faces by Newell's method, of vertices
    weighted by the angles of corners, of corners by fans between sharp edges. Can be pickled.
    """

    def __init__(
        self,
        vertex_count: int | np.integer[Any],
        face_offsets: ArrayLike,
        corner_vertices: ArrayLike,
        edges: ArrayLike | None = None,
        *,
        sharp_edges: ArrayLike | None = None,
        sharp_faces: ArrayLike | None = None,
        custom_normals: ArrayLike | None = None,
    ) -> None:
        """vertex_count: number of vertices, at most 2^29 - 1.
        face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
        corner_vertices: int32 [corners], the vertex of each corner; at most 2^28 - 1.
        edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces; None if
            nothing is sharp or custom.
        sharp_edges: None, or bool [edges].
        sharp_faces: None, or bool [faces], which are flat.
        custom_normals: None, or int16 [corners, 2], as in Blender's attribute custom_normal.

        All input is copied. Raises ValueError that names the argument, what was expected and what was
        given.
        """
    @property
    def domain(self) -> str:
        """The simplest domain that describes the mesh's shading, as Blender's Mesh.normals_domain: "face"
        if every face is flat or every edge sharp, else "corner" if anything is sharp, else "vertex". With
        custom normals always "corner".
        """
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
    @property
    def corner_count(self) -> int:
        """Number of corners of faces."""
    @property
    def face_count(self) -> int:
        """Number of faces."""
    def compute(
        self,
        points: ArrayLike,
        domain: str | None = None,
        out: NDArray[np.float32] | None = None,
        threads: int | np.integer[Any] | None = None,
    ) -> NDArray[np.float32]:
        """Unit vectors, float32 [vertices, corners or faces, 3].

        points: float32 [vertices, 3], deformed.
        domain: "vertex", "corner" or "face": what each normal belongs to; None: the mesh's domain.
        out: if given, written and returned: float32, C-contiguous, aligned; never converted. Must not
            overlap the points.
        threads: maximum number; None or 0: as many as useful. The
            result is the same bit for bit.

        For a face without area the normal is (0, 0, 1); for a vertex without faces, the direction of its
        point; for a vertex whose faces' normals cancel, 0. No result is NaN. Releases the GIL for large
        meshes. Raises ValueError that names the argument, what was expected and what was given.
        """

@final
class SkinnedNormals:
    """Normals and tangents that move with the skin, as in engines: each is transformed by the blend of its
    vertex, normals by the inverse transpose. The effect of weights that change from vertex to vertex is
    not included.
    """

    def __init__(
        self,
        binding: Binding,
        normals: ArrayLike,
        tangents: ArrayLike | None = None,
        vertices: ArrayLike | None = None,
        method: str = "lbs",
        mix: tuple[str, ArrayLike] | None = None,
    ) -> None:
        """binding: a Binding; not copied.
        normals: float32 [frames, 3], at rest, of any length.
        tangents: None, or float32 [frames, 3].
        vertices: int32 [frames], the vertex of each, such as for the corners of faces; None: one frame for
            each vertex.
        method, mix: as for Deformer.

        Raises ValueError that names the argument, what was expected and what was given.
        """
    @property
    def frame_count(self) -> int:
        """Number of normals."""
    def deform(
        self,
        bone_transforms: ArrayLike,
        threads: int | np.integer[Any] | None = None,
        bones_from_model: ArrayLike | None = None,
        rest_inverses: ArrayLike | None = None,
        parameters: Mapping[str, float | bool | str] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32] | None]:
        """(points, normals, tangents): the deformed points, float32 [vertices, 3]; unit vectors, float32
        [frames, 3]; the same for tangents, or None.

        Arguments are those of Deformer.deform. Where the blend mirrors, a normal points to the side given
        by the order of a face's vertices. Where the blend collapses the plane of a normal to a line, that
        normal is 0. Releases the GIL for large meshes. Raises ValueError that names the argument, what was
        expected and what was given.
        """
    def deform_normals(
        self,
        bone_transforms: ArrayLike,
        points: ArrayLike,
        out: NDArray[np.float32] | None = None,
        threads: int | np.integer[Any] | None = None,
        bones_from_model: ArrayLike | None = None,
        rest_inverses: ArrayLike | None = None,
        parameters: Mapping[str, float | bool | str] | None = None,
    ) -> NDArray[np.float32]:
        """Only the normals, if the points are known; saves a quarter of the time.

        points: float32 [vertices, 3], as computed by deform() or a Deformer for the same arguments.
        out: if given, written and returned: float32 [frames, 3], C-contiguous; None: a new array.

        All other arguments as for deform().
        """
