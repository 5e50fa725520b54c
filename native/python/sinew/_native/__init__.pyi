"""Sinew's C++ library. Use it through the package `sinew`."""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import typing
from . import affine
from . import quat_vec
from . import dual_quat
from . import dual
from . import quat
from . import interpolate
from . import spline
__all__: list = ['Parameter', 'Method', 'Stage', 'methods', 'stages', 'Binding', 'Deformer', 'Normals', 'SkinnedNormals', 'Precomputation', 'centres_of_rotation', 'direct_delta_mush', 'Lock', 'thread_id', 'keep_thread_state', 'weights_in_memory', 'crossing_triangles', 'TwistSpread', 'BulgeLimit', 'DeltaMush']
class Parameter:
    """A setting of a method or of a stage."""
    def __repr__(self) -> str: ...
    @property
    def choices(self) -> tuple[str, ...]:
        """The values of an enum."""
    @property
    def default(self) -> float | int | bool | str | None:
        """The default; None for a vertex group and a method."""
    @property
    def description(self) -> str:
        """One sentence."""
    @property
    def id(self) -> str:
        """The name in programs."""
    @property
    def kind(self) -> typing.Literal['float', 'int', 'bool', 'enum', 'vertex_group', 'method']:
        """A value of "enum" is one of `choices`, of "vertex_group" a weight for each vertex, of "method" a name."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def max(self) -> float | None:
        """The largest value of a number, inf if there is no limit; None for other kinds."""
    @property
    def min(self) -> float | None:
        """The smallest value of a number, -inf if there is no limit; None for other kinds."""
    @property
    def unit(self) -> str:
        """One of "length", "angle" (radians) and "factor", or empty."""
class Method:
    """The facts about a skinning method."""
    def __repr__(self) -> str: ...
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def group(self) -> str:
        """The heading of its group in menus."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def name(self) -> str:
        """The name in programs."""
    @property
    def needs(self) -> tuple[str, ...]:
        """What it needs besides points, influences and bone transforms: "rest_bones", the bones' axes, where bones are
        scaled; "vertex_data", numbers for each vertex, an argument of Binding; "topology", triangles from which these
        are computed; "precomputation", a function that computes them.
        """
    @property
    def number(self) -> int:
        """The number that .blend files store. It never changes."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings."""
    @property
    def rows_by_bone(self) -> bool:
        """Whether its vertex data is rows, any number for each vertex: see direct_delta_mush."""
    @property
    def source(self) -> str:
        """The papers."""
    @property
    def vertex_floats(self) -> int:
        """How many numbers its vertex data has for each vertex, or in each row; 0 if it has none."""
class Stage:
    """The facts about a stage. Stages run after a method."""
    def __repr__(self) -> str: ...
    @property
    def description(self) -> str:
        """One sentence: when to use it."""
    @property
    def label(self) -> str:
        """The name in the interface."""
    @property
    def name(self) -> str:
        """The name in programs."""
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Its settings."""
    @property
    def source(self) -> str:
        """The papers."""
class Binding:
    """A mesh bound to bones. Immutable; the deformers made from it share its memory.

    Can be pickled: the bound mesh, with normalised weights.
    """
    def __getstate__(self) -> tuple: ...
    def __init__(self, rest_points: numpy.typing.ArrayLike, influence_offsets: numpy.typing.ArrayLike, influence_bones: numpy.typing.ArrayLike, influence_weights: numpy.typing.ArrayLike, rest_bones: numpy.typing.ArrayLike | None = None, vertex_data: collections.abc.Mapping[str, numpy.typing.ArrayLike | None] | None = None) -> None:
        """rest_points: float32 [vertices, 3], model space.
        influence_offsets: int32 [vertices + 1], the first influence of each vertex, then the end.
        influence_bones: int32 [influences].
        influence_weights: float32 [influences], >= 0, any sum (they are normalised).
        rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], orthonormal, Y along the bone, in the space of the bone
            transforms. Read by sbs, and by other rigid methods where a bone is scaled. None: identity.
        vertex_data: a dict of the vertex data of methods, float32 [vertices, Method.vertex_floats] by the method's
            name: {"cor": sinew.centres_of_rotation(...)}. A Deformer of such a method needs it. None in its place asks
            for linear blending: {"cor": None}.

        At most 2^31 - 1 vertices and influences, 65,536 influences for a vertex, 1,048,576 bones.
        """
    def __repr__(self) -> str: ...
    def __setstate__(self, arg0: typing.Any) -> None: ...
    @property
    def bone_count(self) -> int:
        """How many bones a pose must have: one more than the highest that an influence or vertex data names."""
    @property
    def influence_count(self) -> int:
        """Number of influences of positive weight."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
class Deformer:
    """A binding and a method, ready to deform any pose.

    Can be pickled, with its current rest points and its own binding.
    """
    def __getstate__(self) -> tuple: ...
    @typing.overload
    def __init__(self, binding: Binding, method: str = 'lbs', mix: tuple[str, numpy.typing.ArrayLike] | None = None) -> None:
        """binding: a Binding; not copied.
        method: the name of one of sinew.methods().
        mix: None, or (name of another method, weights): weights float32 [vertices] are the share of the other method
            at each vertex, from 0 (none) to 1 (all); clamped. This is the stage `mix`.
        """
    @typing.overload
    def __init__(self, rest_points: numpy.typing.ArrayLike, influence_offsets: numpy.typing.ArrayLike, influence_bones: numpy.typing.ArrayLike, influence_weights: numpy.typing.ArrayLike, method: str = 'lbs', rest_bones: numpy.typing.ArrayLike | None = None, vertex_data: collections.abc.Mapping[str, numpy.typing.ArrayLike | None] | None = None) -> None:
        """Constructs its own binding, from the arguments of Binding."""
    def __repr__(self) -> str: ...
    def __setstate__(self, arg0: typing.Any) -> None: ...
    def deform(self, bone_transforms: numpy.typing.ArrayLike, out: numpy.typing.NDArray[numpy.float32] | None = None, threads: typing.SupportsIndex | None = None, bones_from_model: numpy.typing.ArrayLike | None = None, rest_inverses: numpy.typing.ArrayLike | None = None, parameters: collections.abc.Mapping[str, float | bool | str] | None = None, parents: numpy.typing.ArrayLike | None = None, turns: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The deformed points, float32 [vertices, 3], model space.

        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest; a fourth row is not read.
        bones_from_model: float32 [4, 4] or [3, 4], maps model space to the space of the bone transforms, in which the
            bones are blended; the result is mapped back. None: the same space.
        rest_inverses: float64 [bones, 4, 4] or [bones, 3, 4]. If given, bone_transforms are the posed bones, and each
            is multiplied by the inverse of its rest transform, in double.
        parameters: a dict of values of methods' parameters by their full names, METHOD.PARAMETER, as described by
            Parameter; missing ones have their defaults. Parameters of methods that the deformer does not use have no
            effect.
        parents: int32 [bones], the parent of each bone, which precedes it, -1 for none: where the parameter `signs` is
            "hierarchy", rotations add up along chains, beyond half a turn. None: each bone turns the shorter way.
        turns: float32 [bones, 4] or fewer bones, the rotation of each against its parent in the space of the bones, as
            its channels give it: a unit quaternion (w, x, y, z) whose sign says whether the bone went the longer way. 0:
            unknown. One that is over 5 degrees from the bone has no effect, nor has any without `parents`.

        A vertex without influences is not moved.
        """
    def set_rest_points(self, rest_points: numpy.typing.ArrayLike) -> None:
        """Sets the rest points of this deformer alone, float32 [vertices, 3], such as when shape keys change.
        Other threads may deform meanwhile: each of their results has either the old points or the new ones.
        """
    @property
    def bone_count(self) -> int:
        """How many bones a pose must have: one more than the highest that an influence or vertex data names."""
    @property
    def influence_count(self) -> int:
        """Number of influences of positive weight."""
    @property
    def method(self) -> str:
        """The name of the method."""
    @property
    def mixed_method(self) -> str | None:
        """The name of the method that `mix` adds, or None."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
class Normals:
    """Normals of a mesh that deforms, as Blender defines them: of faces by Newell's method, of vertices weighted
    by the angles of corners, of corners by fans between sharp edges.
    """
    def __init__(self, vertex_count: typing.SupportsIndex, face_offsets: numpy.typing.ArrayLike, corner_vertices: numpy.typing.ArrayLike, edges: numpy.typing.ArrayLike | None = None, *, sharp_edges: numpy.typing.ArrayLike | None = None, sharp_faces: numpy.typing.ArrayLike | None = None, custom_normals: numpy.typing.ArrayLike | None = None) -> None:
        """vertex_count: number of vertices, at most 2^29 - 1.
        face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
        corner_vertices: int32 [corners], the vertex of each corner; at most 2^28 - 1.
        edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces; None if nothing is
            sharp or custom.
        sharp_edges: None, or bool [edges].
        sharp_faces: None, or bool [faces], which are flat.
        custom_normals: None, or int16 [corners, 2], as in Blender's attribute custom_normal.
        """
    def __repr__(self) -> str: ...
    def compute(self, points: numpy.typing.ArrayLike, domain: typing.Literal['vertex', 'corner', 'face'] | None = None, out: numpy.typing.NDArray[numpy.float32] | None = None, threads: typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """Unit vectors, float32 [vertices, corners or faces, 3].

        points: float32 [vertices, 3], deformed.
        domain: "vertex", "corner" or "face": what each normal belongs to; None: the mesh's domain.
        out: must not overlap the points.

        For a face without area the normal is (0, 0, 1); for a vertex without faces, the direction of its point; for a
        vertex whose faces' normals cancel, 0. No result is NaN.
        """
    @property
    def corner_count(self) -> int:
        """Number of corners of faces."""
    @property
    def domain(self) -> typing.Literal['vertex', 'corner', 'face']:
        """The simplest domain that describes the mesh's shading, as Blender's Mesh.normals_domain: "face" if every
        face is flat or every edge sharp, else "corner" if anything is sharp, else "vertex". With custom normals always
        "corner".
        """
    @property
    def face_count(self) -> int:
        """Number of faces."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
class SkinnedNormals:
    """Normals and tangents that move with the skin, as in engines: each is transformed by the blend of its
    vertex, normals by the inverse transpose. The effect of weights that change from vertex to vertex is not
    included. A frame is a normal and, if there are tangents, its tangent.
    """
    def __init__(self, binding: Binding, normals: numpy.typing.ArrayLike, tangents: numpy.typing.ArrayLike | None = None, vertices: numpy.typing.ArrayLike | None = None, method: str = 'lbs', mix: tuple[str, numpy.typing.ArrayLike] | None = None) -> None:
        """binding: a Binding; not copied.
        normals: float32 [frames, 3], at rest, of any length.
        tangents: None, or float32 [frames, 3], at rest, of any length.
        vertices: int32 [frames], the vertex of each, such as for the corners of faces; None: one frame for each
            vertex.
        method, mix: as for Deformer.
        """
    def __repr__(self) -> str: ...
    def deform(self, bone_transforms: numpy.typing.ArrayLike, threads: typing.SupportsIndex | None = None, bones_from_model: numpy.typing.ArrayLike | None = None, rest_inverses: numpy.typing.ArrayLike | None = None, parameters: collections.abc.Mapping[str, float | bool | str] | None = None, parents: numpy.typing.ArrayLike | None = None, turns: numpy.typing.ArrayLike | None = None) -> tuple[numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32], numpy.typing.NDArray[numpy.float32] | None]:
        """(points, normals, tangents): the deformed points, float32 [vertices, 3]; normals of unit length, float32
        [frames, 3]; the same for tangents, or None.

        The arguments are those of Deformer.deform(). Where the blend mirrors, a normal points to the side given by the
        order of a face's vertices. Where the blend collapses the plane of a normal to a line, that normal is 0.
        """
    def deform_normals(self, bone_transforms: numpy.typing.ArrayLike, points: numpy.typing.ArrayLike, out: numpy.typing.NDArray[numpy.float32] | None = None, threads: typing.SupportsIndex | None = None, bones_from_model: numpy.typing.ArrayLike | None = None, rest_inverses: numpy.typing.ArrayLike | None = None, parameters: collections.abc.Mapping[str, float | bool | str] | None = None, parents: numpy.typing.ArrayLike | None = None, turns: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The normals alone, float32 [frames, 3], where the points are known; saves a quarter of the time.

        points: float32 [vertices, 3], as computed by deform() or a Deformer for the same arguments.
        out: must not overlap the points.

        The other arguments are those of deform().
        """
    @property
    def frame_count(self) -> int:
        """Number of frames: as many as normals at rest."""
class Precomputation:
    """A computation of a method's vertex data. It runs on threads of its own, and on copies of its arguments. It is
    cancelled when nobody refers to it any more, and when Python ends.
    """
    def cancel(self) -> None:
        """Returns at once. The result is then None, unless there already was one."""
    def result(self) -> numpy.typing.NDArray[numpy.float32] | None:
        """Waits until it has ended, and returns the array, the same one each time; None if it was cancelled, or if
        this is a process that was forked meanwhile. Raises what the work raised: ValueError for data that Binding
        refuses, too.
        """
    def wait(self, seconds: float | None = None) -> bool:
        """Waits until it has ended, at most this long. Returns whether it has. Ctrl-C raises KeyboardInterrupt."""
    @property
    def has_ended(self) -> bool:
        """Whether it is done, has failed or was cancelled."""
    @property
    def progress(self) -> float:
        """The completed share, 0 to 1."""
class Lock:
    """For `with`: one thread at a time is inside."""
    def __enter__(self) -> None: ...
    def __exit__(self, arg0: typing.Any, arg1: typing.Any, arg2: typing.Any) -> None: ...
    def __init__(self) -> None:
        """A thread that is inside may enter again. A forked child finds nobody inside."""
class TwistSpread:
    """The stage `twist_spread` for one mesh: spreads the twist of a bone against the next along the bone, as twist
    bones do. Applied after Deformer.deform() and before all other stages.
    """
    def __init__(self, binding: Binding, twists: numpy.typing.ArrayLike, heads: numpy.typing.ArrayLike, tails: numpy.typing.ArrayLike, rest_bones: numpy.typing.ArrayLike, *, parents: numpy.typing.ArrayLike | None = None, bones_from_model: numpy.typing.ArrayLike | None = None, weights: numpy.typing.ArrayLike | None = None, mix: numpy.typing.ArrayLike | None = None) -> None:
        """binding: the mesh. Its memory is shared.
        twists: int32 [twists, 4], a bone before those that it carries. The first bone's vertices share, about the line from
            its head to its tail, the twist of the third bone relative to the second. The fourth number is 0 where it is
            added towards the tail (the hand's twist to the forearm), 1 where it is taken back towards the head (an upper
            arm's own).
        heads, tails: float32 [twists, 3], between which the share of the twist grows from 0 to 1, at rest, in the space of
            the bone transforms. Where both are the same, the line is along the bone's Y axis.
        rest_bones: float32 [bones, 4, 4] or [bones, 3, 4], each bone at rest in that space, Y along it.
        parents: None, or int32 [bones], -1 for none. Only twists beyond half a turn need them.
        bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same space.
        weights: None, or float32 [vertices], how much each vertex takes part, 0 to 1; clamped.
        mix: None, or float32 [vertices], the weights of Deformer's `mix`.
        """
    def __repr__(self) -> str: ...
    def angles(self, bone_transforms: numpy.typing.ArrayLike, channels: numpy.typing.ArrayLike | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The twists in a pose, float32 [twists], radians, as apply() spreads them by an amount of 1: faded from 150
        degrees to 180, where a matrix does not tell them.

        bone_transforms, channels: as for apply().
        """
    def apply(self, points: numpy.typing.ArrayLike, bone_transforms: numpy.typing.ArrayLike, out: numpy.typing.NDArray[numpy.float32] | None = None, *, amount: float = 1.0, amounts: numpy.typing.ArrayLike | None = None, curves: numpy.typing.ArrayLike | None = None, channels: numpy.typing.ArrayLike | None = None, blend: typing.Literal['linear', 'matrices', 'rotations', 'logarithms'] = 'linear', mix_blend: typing.Literal['linear', 'matrices', 'rotations', 'logarithms'] = 'linear', threads: typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The twisted points, float32 [vertices, 3], model space.

        points: float32 [vertices, 3], deformed, model space.
        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for Deformer.deform().
        out: may be `points`.
        amount: how much of each twist is spread, 0 to 1.
        amounts: None, or float32 [twists], the same for each bone.
        curves: None, or float32 [twists], -1 to 1: below 0 more of the twist is near the tail, above 0 near the head.
        channels: None, or float32 [twists, 7], the rotation channels of each tip: its rotation from rest on its own rest
            axes, (w, x, y, z), and Euler angles or the product of angle and unit axis, radians. They say how far beyond half
            a turn it went, up to two turns, unless something else rotates the bone as well. All 0: unknown.
        blend: how the method of the points blends rotations: "linear" (lbs), "matrices" (ddm), "rotations" (all others), or
            "logarithms" (log, dib). With "linear" the bone's matrix M of each vertex becomes M R; otherwise the vertex is
            rotated about the posed axis by its weight times its share of the twist.
        mix_blend: the same for the second method, where `mix` is above 0.

        Where no bone is twisted, no bit changes.
        """
    def set_rest_points(self, rest_points: numpy.typing.ArrayLike, bones_from_model: numpy.typing.ArrayLike | None = None) -> None:
        """Sets other rest points, float32 [vertices, 3], and the space of the bones: None is the identity, whatever
        was set before.
        """
    @property
    def bone_count(self) -> int:
        """How many bones a pose must have."""
    @property
    def twist_count(self) -> int:
        """Number of twists."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
class BulgeLimit:
    """The stage `bulge_limit` for one mesh: moves deformed points back towards their bones where blending took
    them farther away than they are at rest (Kim, Han 2014, and a continuous form).
    """
    def __init__(self, binding: Binding, heads: numpy.typing.ArrayLike, tails: numpy.typing.ArrayLike, *, bones_from_model: numpy.typing.ArrayLike | None = None, weights: numpy.typing.ArrayLike | None = None) -> None:
        """binding: the mesh. Its memory is shared.
        heads, tails: float32 [bones, 3], the ends of each bone at rest, in the space of the bone transforms.
        bones_from_model: float32 [4, 4] or [3, 4], maps model space to that space. None: the same space.
        weights: None, or float32 [vertices], how much each vertex is limited, 0 to 1; clamped.
        """
    def __repr__(self) -> str: ...
    def apply(self, points: numpy.typing.ArrayLike, bone_transforms: numpy.typing.ArrayLike, out: numpy.typing.NDArray[numpy.float32] | None = None, *, strength: float = 1.0, form: typing.Literal['continuous', 'kim_han'] = 'continuous', threads: typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The limited points, float32 [vertices, 3], model space.

        points: float32 [vertices, 3], deformed, model space.
        bone_transforms: float32 [bones, 4, 4] or [bones, 3, 4], posed_from_rest, as for Deformer.deform().
        out: may be `points`.
        strength: how much of the bulge is removed, 0 to 1.
        form: "continuous": distances to all bones of a vertex, weighted; "kim_han": only to the heaviest, which tears
            the surface where that changes.

        Vertices with fewer than two bones are not changed, nor is any vertex in the rest pose, bit for bit. A scaled
        bone allows a distance larger by the largest factor by which it stretches vectors perpendicular to it.
        """
    def set_rest_points(self, rest_points: numpy.typing.ArrayLike, bones_from_model: numpy.typing.ArrayLike | None = None) -> None:
        """Sets other rest points, float32 [vertices, 3], and the space of the bones: None is the identity, whatever
        was set before.
        """
    @property
    def bone_count(self) -> int:
        """How many bones a pose must have."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
class DeltaMush:
    """The stage `delta_mush` for one mesh: smooths deformed points and adds the details of the rest points back
    (Mancewicz et al. 2014), as Blender's Corrective Smooth does.
    """
    def __init__(self, rest_points: numpy.typing.ArrayLike, face_offsets: numpy.typing.ArrayLike, corner_vertices: numpy.typing.ArrayLike, edges: numpy.typing.ArrayLike, *, iterations: typing.SupportsIndex = 5, radius: float = 0.0, factor: float = 0.5, smooth_type: typing.Literal['simple', 'length_weighted'] = 'simple', pin_boundary: bool = False, weights: numpy.typing.ArrayLike | None = None) -> None:
        """rest_points: float32 [vertices, 3], without shape keys; at most 2^29 - 1 vertices.
        face_offsets: int32 [faces + 1], the first corner of each polygon, then the end.
        corner_vertices: int32 [corners], the vertex of each corner.
        edges: int32 [edges, 2], the vertices of all edges of faces, and of edges without faces.
        iterations: number of smoothing iterations, 0 to 1,000; not used with a radius.
        radius: how far the smoothing reaches, in units of the points, as the width of a Gaussian, independently of
            the density of the mesh; 0: use `iterations`. The shortest tenth of edges is smoothed less far, and so are
            all where this would take more than 1,000 iterations.
        factor: how far one iteration moves a vertex, 0 to 1.
        smooth_type: "simple", or "length_weighted": neighbours are weighted by the length of their edges.
        pin_boundary: whether vertices on edges with a single face are not moved.
        weights: None, or float32 [vertices], how much each vertex is smoothed, 0 to 1; clamped.
        """
    def __repr__(self) -> str: ...
    def apply(self, points: numpy.typing.ArrayLike, out: numpy.typing.NDArray[numpy.float32] | None = None, scale: float = 1.0, threads: typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.float32]:
        """The smoothed points, float32 [vertices, 3].

        points: float32 [vertices, 3], deformed, in the space of the rest points.
        out: may be `points`.
        scale: how much of the details is added back; 1: all.

        A vertex without faces is smoothed and has no details.
        """
    def bind(self, rest_points: numpy.typing.ArrayLike, *, iterations: typing.SupportsIndex = 5, radius: float = 0.0, factor: float = 0.5, smooth_type: typing.Literal['simple', 'length_weighted'] = 'simple', pin_boundary: bool = False, weights: numpy.typing.ArrayLike | None = None) -> None:
        """Sets other rest points and settings for the same faces and edges, which takes about as long as apply().

        The arguments and errors are those of the constructor; after an error the object is unchanged.
        """
    @property
    def iterations(self) -> int:
        """Number of smoothing iterations, also if a radius determines it."""
    @property
    def vertex_count(self) -> int:
        """Number of vertices."""
def centres_of_rotation(rest_points: numpy.typing.ArrayLike, influence_offsets: numpy.typing.ArrayLike, influence_bones: numpy.typing.ArrayLike, influence_weights: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, *, exact: bool = False, threads: typing.SupportsIndex | None = None, gives_way: bool = False) -> Precomputation:
    """Starts to compute the vertex data of the method "cor": the optimised centre of rotation of each vertex,
    float32 [vertices, 3], model space, for `vertex_data` of Binding (Le, Hodgins 2016). It belongs to these rest
    points.

    rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
    triangles: int32 [triangles, 3], vertices.
    exact: compute by the definition itself, which is slow; otherwise triangles of similar weights are summed.
    gives_way: at a low priority, so that frames which are deformed meanwhile lose little; on a busy machine it then
        takes much longer.
    """
def crossing_triangles(points: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, groups: typing.Any = None, threads: typing.SupportsIndex | None = None) -> numpy.typing.NDArray[numpy.int32]:
    """Pairs of triangles of a surface that cross, int32 [pairs, 2]: an edge of one meets the other, and they
    share no vertex. The lower index comes first, and pairs ascend. Triangles in one plane do not cross, nor do those of
    points that are NaN.

    points: float64 [vertices, 3].
    triangles: int32 [triangles, 3].
    groups: int32 [triangles]; two of one group do not count, as where one bone moves both. Below 0: of none.
    """
def direct_delta_mush(rest_points: numpy.typing.ArrayLike, influence_offsets: numpy.typing.ArrayLike, influence_bones: numpy.typing.ArrayLike, influence_weights: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, radius: typing.SupportsFloat | typing.SupportsIndex, *, exact: bool = False, threads: typing.SupportsIndex | None = None, gives_way: bool = False) -> Precomputation:
    """Starts to compute the vertex data of the method "ddm": the moments of each bone's smoothed weights around
    each vertex (Le, Lewis 2019), float32 [rows, 12], for `vertex_data` of Binding. A row is vertex, bone, weight,
    first moment (x, y, z; from the origin) and second moment (xx, yy, zz, yz, xz, xy; about the sum of the
    vertex's first moments). Rows are in ascending order of vertices and, for each vertex, of bones. They belong to
    these rest points and this radius.

    rest_points, influence_offsets, influence_bones, influence_weights: as for Binding.
    triangles: int32 [triangles, 3], vertices.
    radius: how far the smoothing reaches, 0 or more, in units of the rest points: the standard deviation along
        each axis.
    exact: include weights below 1e-6, which are otherwise left out.
    gives_way: as for centres_of_rotation().

    RuntimeError if Sinew was built without this method.
    """
def keep_thread_state() -> None:
    """Keeps Python's state of the calling thread until the thread ends. If Python did not start that thread, each
    later call from it takes 50 to 100 us less. May be called again, and on any thread.
    """
def methods() -> tuple[Method, ...]:
    """All skinning methods."""
def stages() -> tuple[Stage, ...]:
    """All stages. `mix` is an argument of Deformer, each other a class: `bulge_limit` is BulgeLimit."""
def thread_id() -> int:
    """A number that no other thread has as long as this one runs."""
def weights_in_memory(address: typing.SupportsInt | typing.SupportsIndex, vertices: typing.SupportsInt | typing.SupportsIndex, known: tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.int32], typing.Annotated[numpy.typing.ArrayLike, numpy.int32], typing.Annotated[numpy.typing.ArrayLike, numpy.float32]] | None = None) -> tuple:
    """The vertex groups of a mesh, read from the memory of the Blender that this runs in: int32 [vertices], how
    many entries each vertex has; int32 [entries], the group of each, in the order of the vertices and as stored; float32
    [entries], its weight. ValueError where this can be no such memory.

    address   of the mesh's MDeformVert array, one for each vertex; a wrong one crashes the process or gives garbage
    vertices  how many
    known     what this returned before: these very arrays are returned where the memory still has the same
    """
__compiled_in__: str
__version__: str
