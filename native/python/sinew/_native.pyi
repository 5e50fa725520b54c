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
        """What programs say."""
    @property
    def label(self) -> str:
        """What people read."""
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
        """None for a vertex group and a method."""
    @property
    def min(self) -> float | None:
        """The least value of a number, -inf where there is none; None for other kinds."""
    @property
    def max(self) -> float | None:
        """The largest value of a number, inf where there is none; None for other kinds."""
    @property
    def choices(self) -> tuple[str, ...]:
        """The values of an enum."""

@final
class Method:
    """The facts of a skinning method."""

    @property
    def number(self) -> int:
        """Number that .blend files store; never changes."""
    @property
    def name(self) -> str:
        """What programs say."""
    @property
    def label(self) -> str:
        """What people read."""
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def source(self) -> str:
        """The papers."""
    @property
    def group(self) -> str:
        """The heading below which menus show it, with those that are for the same."""
    @property
    def needs(self) -> tuple[str, ...]:
        """What it takes besides points, influences and bone transforms: "rest_bones", their axes where bones
        are scaled; "vertex_data", numbers of each vertex that Binding takes; "topology", triangles that
        these are made from; "precomputation", a function that makes them."""
    @property
    def vertex_floats(self) -> int:
        """How many numbers its vertex data has for each vertex, or in each row; 0: it has none."""
    @property
    def keeps_moments(self) -> bool:
        """Whether its vertex data has rows, any number for each vertex: see direct_delta_mush."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings, one Parameter each."""

@final
class Stage:
    """The facts of a stage: what may follow a method."""

    @property
    def name(self) -> str:
        """What programs say."""
    @property
    def label(self) -> str:
        """What people read."""
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def source(self) -> str:
        """The papers."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings, one Parameter each."""

def methods() -> tuple[Method, ...]:
    """Every skinning method, one Method each."""

def stages() -> tuple[Stage, ...]:
    """Every stage, one Stage each. `mix` is an argument of Deformer, `bulge_limit` is BulgeLimit,
    `delta_mush` is DeltaMush."""

def keep_thread_state() -> None:
    """Keeps Python's state of the calling thread until that ends: a thread that Python did not start, and
    that calls it often, is 50 to 100 us a call faster. Safe to call again, and on any thread."""

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
    """What the method "cor" keeps of each vertex: its optimised centre of rotation, float32 [vertices, 3],
    model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest points.

    rest_points, influence_offsets, influence_bones, influence_weights: as of Binding.
    triangles: int32 [triangles, 3], vertices.
    exact: by the definition itself, slowly; else triangles of like weights are added up.
    threads: how many at most; None: as many as help. The result is the same bit for bit.
    progress: None, or a callable that is called on this thread with the share that is done, 0 to 1.
        Where it returns False the work ends, and the result is None. What it raises comes through.

    Precomputations of other methods take `threads` and `progress` alike. The GIL is released.
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
    """What the method "ddm" keeps: the moments of each bone's smoothed weights about each vertex (Le, Lewis
    2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight, first moment
    (x, y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of the vertex's first
    moments); vertices rise, and bones of a vertex. It belongs to these rest points and this radius.

    rest_points, influence_offsets, influence_bones, influence_weights: as of Binding.
    triangles: int32 [triangles, 3], vertices.
    radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard deviation
        along each axis.
    exact: also weights below 1e-6; else these are left out.
    threads, progress: as of centres_of_rotation. The GIL is released.

    Raises RuntimeError where Sinew was built without this method.
    """

@final
class Skeleton:
    """A hierarchy of bones; parents come before their children.

    Its methods take each bone relative to its parent, in any representation, layouts as in sinew.affine,
    sinew.quat_vec and sinew.dual_quat, and promote arrays as these do. They raise ValueError that names
    the argument, what was wanted and what came.
    """

    def __init__(self, parents: ArrayLike) -> None:
        """parents: int32 [bones], the index of each bone's parent, -1 for a root.

        Raises ValueError where a parent does not come before its child.
        """
    @property
    def bone_count(self) -> int:
        """Bones of the hierarchy."""
    def root_relative(self, transforms: ArrayLike, root: ArrayLike | None = None) -> NDArray[Any]:
        """Each bone relative to the root, in the representation that came (Smith 2013, algorithm 1).

        transforms: [bones, 4, 4] or [bones, 3, 4], which give [bones, 4, 4]; [bones, 7]; [bones, 8].
        root: None, or one transform that is placed before every bone without a parent.
        """
    def update_branch(
        self,
        root_relative: ArrayLike,
        transforms: ArrayLike,
        bone: int | np.integer[Any],
        root: ArrayLike | None = None,
    ) -> NDArray[Any]:
        """The same after a change of one bone: computed for that bone and those below it alone.

        root_relative: what root_relative() gave before the change, in the representation of `transforms`.
        transforms, root: as of root_relative().
        bone: the index of the bone that has changed.
        """
    def interpolate(
        self, a: ArrayLike, b: ArrayLike, t: ArrayLike, method: str = "dlb"
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """(transforms, is_defined): the skeleton between two keyframes (Smith 2013, algorithm 2).

        a, b: [bones, ..] in the representation of the method, at t = 0 and t = 1.
        t: a number or [..], which give [.., bones, ..] and [..]; outside 0 to 1 the motion goes on.
        method: one of sinew.interpolate.METHODS.
        is_defined: False where a bone has no one in-between; it then has what sinew.interpolate.between
            gives there.
        """
    def spline(
        self, keyframes: ArrayLike, times: ArrayLike, time: ArrayLike, method: str = "dlb"
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """(transforms, is_defined): the skeleton on a Catmull-Rom spline through keyframes, blend form
        (Smith 2013, algorithm 3 and section 3.2.2).

        keyframes: [keys, bones, ..] in the representation of the method, one key or more.
        times: [keys], not decreasing; keys of equal time are a cut.
        time: a number or [..], which give [.., bones, ..] and [..]; before the first key and after the last
            it is that key.
        method: one of sinew.interpolate.METHODS.
        """
    def spline_vector(
        self, keyframes: ArrayLike, times: ArrayLike, time: ArrayLike
    ) -> tuple[NDArray[Any], bool | NDArray[np.bool_]]:
        """The same in vector form (Smith 2013, algorithm 3): not rigid between the keys.

        keyframes: [keys, bones, 4, 4], [keys, bones, 3, 4], [keys, bones, 7] or [keys, bones, 8].
        """

@final
class Binding:
    """A mesh bound to bones: immutable, and shared by the deformers made of it."""

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
        influence_weights: float32 [influences], >= 0, any sum (normalised inside).
            At most 2^31 - 1 vertices and influences, 65,536 influences a vertex, 1,048,576 bones.
        rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], orthonormal, Y along the bone, in the space
            of the bone transforms; read where a bone is scaled and the method is rigid, and by sbs. None:
            identity.
        vertex_data: a dict of what methods keep of each vertex, float32 [vertices, Method.vertex_floats] by
            the method's name: {"cor": sinew.centres_of_rotation(...)}. A method whose data is not here
            does without: each vertex is its own centre under cor, which is linear blending.

        Anything that numpy makes such arrays of is taken where nothing but digits of a fraction is lost:
        lists, float64, int64 whose numbers fit. All input is copied. Raises ValueError that names the
        argument, what was wanted and what came. Can be pickled: what was bound, with weights normalised.
        """
    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
    @property
    def influence_count(self) -> int:
        """Influences of positive weight."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone that an influence names."""

@final
class Deformer:
    """A binding and a method, ready to deform at any pose.

    Can be pickled, with the rest points that it has then and a binding of its own.
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
        mix: None, or (name of another method, weights): weights float32 [vertices] say how much of the
            other method each vertex takes, from 0 (none) to 1 (all of it); clamped. As the stage `mix`.
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
        """With a binding of its own, of the arguments that Binding has."""
    @property
    def method(self) -> str:
        """The name of the method."""
    @property
    def mixed_method(self) -> str | None:
        """The name of the method that `mix` adds, or None."""
    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
    @property
    def influence_count(self) -> int:
        """Influences of positive weight."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone that an influence names."""
    def set_rest_points(self, rest_points: ArrayLike) -> None:
        """New rest points for this deformer alone, float32 [vertices, 3], as when shape keys change. Other
        threads may deform meanwhile: each of their results has the old points or the new ones.
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

        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest; a fourth row is not
            read.
        out: written and returned where given: float32 [vertices, 3], C-contiguous, aligned; never
            converted.
        threads: how many at most, any integer: 0 for all of the machine's; None: as many as help. The
            result is the same bit for bit.
        bones_from_model: float32 [4, 4] or [3, 4], takes model space to the space of the bone
            transforms, where the blending happens; the result is taken back. None: the same space.
        rest_inverses: float64 [bones, 4, 4] or [bones, 3, 4]. Where given, bone_transforms are the posed
            bones, and each is multiplied by the inverse of its rest, in double.
        parameters: a dict of values of parameters of methods by their full names, METHOD.PARAMETER, as the
            Parameter says; one that is not here has its default. Those of methods that the deformer does
            not use change nothing.

        A vertex without influences stays. The GIL is released for large meshes. Raises ValueError that
        names the argument, what was wanted and what came.
        """

@final
class BulgeLimit:
    """The stage `bulge_limit` of one mesh: takes deformed points back towards their bones where blending took
    them farther away than they are at rest (Kim, Han 2014, and a continuous form). Can be pickled.
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
        """rest_points, influence_offsets, influence_bones, influence_weights: as of Binding.
        heads, tails: float32 [bones, 3], the ends of each bone at rest, in the space of the bone transforms.
        bones_from_model: float32 [4, 4] or [3, 4], takes model space to that space. None: the same.
        weights: None, or float32 [vertices], how much each vertex is limited, 0 to 1; clamped.

        All input is copied. Raises ValueError that names the argument, what was wanted and what came.
        """
    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
    @property
    def bone_count(self) -> int:
        """One more than the highest bone that an influence names."""
    def set_rest_points(self, rest_points: ArrayLike, bones_from_model: ArrayLike | None = None) -> None:
        """Other rest points, float32 [vertices, 3], or another space of the bones: distances at rest are
        measured again, in about the time of apply()."""
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
        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as of Deformer.deform().
        out: written and returned where given: float32 [vertices, 3], C-contiguous, aligned; never converted.
            May be `points`.
        strength: how much of the bulge is taken away, 0 to 1.
        form: "continuous": distances to all bones of a vertex, by weight; "kim_han": to the heaviest alone,
            which tears the surface where that changes.
        threads: how many at most, any integer: 0 for all of the machine's; None: as many as help. The result
            is the same bit for bit.

        A vertex of fewer than two bones stays, as do all in the rest pose, to the bit. A bone that is scaled
        allows as much more as it stretches what is perpendicular to it, at most. The GIL is released for
        large meshes. Raises ValueError that names the argument, what was wanted and what came.
        """

@final
class DeltaMush:
    """The stage `delta_mush` of one mesh: smooths deformed points and gives them the details of the rest
    points back (Mancewicz et al. 2014), as Blender's Corrective Smooth does. Can be pickled.
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
        edges: int32 [edges, 2], the vertices of every edge of a face and of those without one.
            At most 2^29 - 1 vertices.
        iterations: how often the mesh is smoothed, 0 to 1,000; not used with a radius.
        radius: how far the smoothing reaches, in units of the points, as the width of a Gaussian, however
            dense the mesh is; 0 for so many iterations. The shortest tenth of edges, and all where it would
            take more than 1,000 iterations, are smoothed less far.
        factor: how far one iteration moves a vertex, 0 to 1.
        smooth_type: "simple", or "length_weighted": neighbours count by the length of their edges.
        pin_boundary: the ends of edges with one face are not smoothed.
        weights: None, or float32 [vertices], how much each vertex is smoothed, 0 to 1; clamped.

        All input is copied. Raises ValueError that names the argument, what was wanted and what came.
        """
    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
    @property
    def iterations(self) -> int:
        """How often it smooths, also with a radius."""
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
        """Other rest points and settings, of the same faces and edges; it takes about as long as to apply it.

        Arguments are those of the constructor. Raises ValueError as that does, and is then as it was.
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
        out: written and returned where given: float32 [vertices, 3], C-contiguous, aligned; never converted.
            May be `points`.
        scale: how much of the details comes back; 1 all.
        threads: how many at most, any integer: 0 for all of the machine's; None: as many as help. The result
            is the same bit for bit.

        A vertex without faces is smoothed without details. The GIL is released for large meshes. Raises
        ValueError that names the argument, what was wanted and what came.
        """

@final
class Normals:
    """Normals of one mesh that deforms, as Blender defines them: of faces by Newell's method, of vertices
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
        """vertex_count: vertices of the mesh, at most 2^29 - 1.
        face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
        corner_vertices: int32 [corners], the vertex of each corner; at most 2^28 - 1.
        edges: int32 [edges, 2], the vertices of every edge of a face and of those without one; None where
            nothing is sharp or custom.
        sharp_edges: None, or bool [edges].
        sharp_faces: None, or bool [faces], which are flat.
        custom_normals: None, or int16 [corners, 2], as Blender's attribute custom_normal has them.

        All input is copied. Raises ValueError that names the argument, what was wanted and what came.
        """
    @property
    def domain(self) -> str:
        """The least that says how the mesh is shaded, as Blender's Mesh.normals_domain: "face" where every
        face is flat or every edge sharp, else "corner" where something is sharp, else "vertex". With
        custom normals "corner".
        """
    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
    @property
    def corner_count(self) -> int:
        """Corners of its faces."""
    @property
    def face_count(self) -> int:
        """Faces of the mesh."""
    def compute(
        self,
        points: ArrayLike,
        domain: str | None = None,
        out: NDArray[np.float32] | None = None,
        threads: int | np.integer[Any] | None = None,
    ) -> NDArray[np.float32]:
        """Unit vectors, float32 [vertices, corners or faces, 3].

        points: float32 [vertices, 3], deformed.
        domain: "vertex", "corner" or "face", what each has a normal of its own; None: that of the mesh.
        out: written and returned where given: float32, C-contiguous, aligned; never converted. Not the
            points.
        threads: how many at most, any integer: 0 for all of the machine's; None: as many as help. The result
            is the same bit for bit.

        A face without area has (0, 0, 1). A vertex without faces has the direction of its point. Where the
        normals of faces cancel, that of their vertex is 0. None is NaN. The GIL is released for large
        meshes. Raises ValueError that names the argument, what was wanted and what came.
        """

@final
class SkinnedNormals:
    """Normals and tangents that move with the skin, as engines have them: each by the blend of its own
    vertex, normals by the inverse transpose. What the change of weights does to the surface is not in them.
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
        vertices: int32 [frames], the vertex of each, as for the corners of faces; None: one frame for each
            vertex.
        method, mix: as of Deformer.

        Raises ValueError that names the argument, what was wanted and what came.
        """
    @property
    def frame_count(self) -> int:
        """How many normals it has."""
    def deform(
        self,
        bone_transforms: ArrayLike,
        threads: int | np.integer[Any] | None = None,
        bones_from_model: ArrayLike | None = None,
        rest_inverses: ArrayLike | None = None,
        parameters: Mapping[str, float | bool | str] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32] | None]:
        """(points, normals, tangents): float32 [vertices, 3], the deformed points; float32 [frames, 3], unit
        vectors; the same of tangents, or None.

        Arguments are those of Deformer.deform. Where the blend mirrors, a normal is on the side that the
        order of a face's vertices gives. Where it flattens the plane of a normal to a line, that is 0.
        The GIL is released for large meshes. Raises ValueError that names the argument, what was wanted
        and what came.
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
        """The normals alone, where the points are known: a fourth less to deform.

        points: float32 [vertices, 3], as deform() or a Deformer gave them for the same arguments.
        out: float32 [frames, 3], C-contiguous; made where it is None. It is returned.

        All else is as of deform().
        """
