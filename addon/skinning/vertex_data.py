# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertex data that methods need for one bound mesh, computed when a method is first used, and kept."""

from __future__ import annotations

import hashlib
import itertools
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import sinew

from .influences import Influences, owners_of
from .parameters import Value
from .precompute import Start, precomputations
from .rig import Weighting
from .vectors import transformed
from .weld import Weld, weld

METHODS = {method.name: method for method in sinew.methods()}

log = logging.getLogger("sinew")


@dataclass(frozen=True)
class Provider:
    """What computes the data of a method.

    what        its name, for people
    version     part of the hash: raised when the same mesh gives other data
    start       takes rest points, the arrays of influences, triangles, and by name `gives_way` and
                `parameters`
    parameters  ids of the method's parameters, all numbers, that the data depends on
    welds       it has a parameter `weld`, and its rows begin with their vertex
    """

    what: str
    version: int
    start: Callable[..., sinew.Precomputation]
    parameters: tuple[str, ...] = ()
    welds: bool = False


_ALL = {
    "cor": Provider("centres of rotation", 1, sinew.centres_of_rotation),
    "ddm": Provider("smoothed weights", 2, sinew.direct_delta_mush, ("radius", "weld"), welds=True),
}
# A build may lack one of them.
PROVIDERS = {name: provider for name, provider in _ALL.items() if name in METHODS}


@dataclass
class _Entry:
    """The data of one method. If outdated, `made` has that of the mesh before it changed.

    weld      the places of the mesh that it is computed for; None for all vertices
    computed  of these
    made      of all vertices
    """

    key: str = ""
    start: Start | None = None
    weld: Weld | None = None
    computed: np.ndarray | None = None
    made: np.ndarray | None = None
    is_outdated: bool = False
    run: sinew.Precomputation | None = None


_versions = itertools.count(1)


class VertexData:
    """The vertex data of a mesh at rest, without shape keys. Any thread may use it; nobody writes to the
    arrays.

    weighting  of the bones that move the mesh
    points     float32 [vertices, 3], object space
    triangles  int32 [triangles, 3]; None where no method that needs them was chosen
    stored     what the file has, by its key
    before     of the same object before it changed: with the same number of vertices, its data is used until
               there is new data
    given      data read from the mesh instead of computed here, by the name of the method
    """

    def __init__(
        self,
        weighting: Weighting,
        points: np.ndarray,
        triangles: np.ndarray | None = None,
        stored: Mapping[str, np.ndarray] | None = None,
        before: VertexData | None = None,
        given: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        self.weighting = weighting
        self.points = points
        self.triangles = triangles
        # Changes whenever the data does; 0 as long as there is none.
        self.version = 0
        # Methods whose data was needed and not available.
        self.missed: set[str] = set()
        self.read_at = time.monotonic()
        self._given = dict(given or {})
        self._stored = stored or {}
        self._lock = sinew.Lock()
        self._entries: dict[str, _Entry] = {}
        self._parameters = {name: _values_of(name, {}) for name in PROVIDERS}
        if before is not None:
            self._take_over(before)
        if self._given:
            self.version = next(_versions)

    def _take_over(self, before: VertexData) -> None:
        with before._lock:
            self._parameters = dict(before._parameters)
            for method, entry in before._entries.items():
                if entry.run is not None:
                    # Computed for a mesh that no longer exists.
                    entry.run.cancel()
                if entry.made is not None and len(before.points) == len(self.points):
                    self._entries[method] = _Entry(made=entry.made, is_outdated=True)
                    self.version = before.version

    @property
    def made(self) -> dict[str, tuple[str, np.ndarray]]:
        """For files: the key and what was computed, for each method that has current data."""
        with self._lock:
            entries = self._entries.items()
            return {
                method: (entry.key, entry.computed)
                for method, entry in entries
                if entry.computed is not None and not entry.is_outdated
            }

    def add_triangles(self, triangles: np.ndarray) -> None:
        """Sets the mesh's triangles, if they were not read before."""
        if self.triangles is None:
            self.triangles = triangles

    def take_parameters(self, method: str, values: Mapping[str, Value]) -> None:
        """Sets the parameters of a method. Data made with other values becomes outdated.

        values  by full names; missing ones have their default
        """
        if method not in PROVIDERS or not PROVIDERS[method].parameters:
            return
        taken = _values_of(method, values)
        with self._lock:
            if self._parameters[method] == taken:
                return
            self._parameters[method] = taken
            self.read_at = time.monotonic()
            entry = self._entries.pop(method, None)
            if entry is None:
                return
            if entry.run is not None:
                entry.run.cancel()
            self._entries[method] = _Entry(made=entry.made, is_outdated=entry.made is not None)

    def is_ready(self, method: str) -> bool:
        """Whether of() can return data without computing it, even if outdated; True for a method without
        vertex data. Where precomputations are waited for: whether of() can compute it."""
        if method not in PROVIDERS:
            return True
        with self._lock:
            entry = self._entry(method)
            is_ready = entry.made is not None
            if precomputations.blocks:
                # Outdated data is then computed again, which needs triangles.
                is_ready = self.triangles is not None or (is_ready and not entry.is_outdated)
            if not is_ready:
                self.missed.add(method)
            return is_ready

    def has(self, method: str) -> bool:
        """Whether there is data, even if outdated; True for a method without vertex data."""
        with self._lock:
            return method not in PROVIDERS or self._entry(method).made is not None

    def is_current(self, method: str) -> bool:
        """Whether there is data of this mesh."""
        with self._lock:
            entry = self._entry(method)
            return entry.made is not None and not entry.is_outdated

    def running(self, method: str) -> sinew.Precomputation | None:
        """Returns the running computation, if there is one."""
        with self._lock:
            return self._entry(method).run

    def is_stopped(self, method: str) -> bool:
        """Whether the artist stopped the computation."""
        with self._lock:
            return self._entry(method).key in precomputations.stopped

    def of(self, method: str, bones_from_model: np.ndarray) -> np.ndarray | None:
        """Returns float32 [vertices or rows, Method.vertex_floats], object space; None for a method without
        vertex data. Computes it where there is none.

        bones_from_model  float64 [4, 4], used where weights depend on the vertices' positions; the first call
                          decides
        """
        if method not in PROVIDERS:
            return self._given.get(method)
        with self._lock:
            entry = self._entries.setdefault(method, _Entry())
            if entry.made is not None and not (entry.is_outdated and precomputations.blocks):
                return entry.made
            start = self._prepare(entry, method, bones_from_model)
            if entry.made is not None and not entry.is_outdated:
                return entry.made
        made = precomputations.make_now(entry.key, start)
        with self._lock:
            self._put(entry, made)
        return made

    def request(self, method: str, bones_from_model: np.ndarray) -> None:
        """Finds the data, or computes it where precomputations are waited for, and raises what that raises.
        Otherwise starts to compute it, unless the artist stopped it."""
        if method not in PROVIDERS or self.is_current(method):
            return
        if precomputations.blocks:
            self.of(method, bones_from_model)
            return
        with self._lock:
            entry = self._entries.setdefault(method, _Entry())
            if entry.run is not None:
                return
            start = self._prepare(entry, method, bones_from_model)
            if (entry.made is None or entry.is_outdated) and entry.key not in precomputations.stopped:
                entry.run = precomputations.start(entry.key, start)

    def take_result(self, method: str) -> bool:
        """Takes the result of a computation that has ended. Returns whether one has. Raises what the
        computation raised."""
        with self._lock:
            entry = self._entry(method)
            if entry.run is None or not entry.run.has_ended:
                return False
            run, entry.run = entry.run, None
            made = run.result()
            if made is not None:
                self._put(entry, made)
            return True

    def _entry(self, method: str) -> _Entry:
        """Returns an empty one where there is none. Called under the lock."""
        return self._entries.get(method) or _Entry()

    def _prepare(self, entry: _Entry, method: str, bones_from_model: np.ndarray) -> Start:
        """Finds earlier data; returns what computes it otherwise. Called under the lock."""
        if entry.start is not None:
            return entry.start
        if self.triangles is None:
            raise RuntimeError(f"{method}: the mesh's triangles were not read")
        points = self.points
        if self.weighting.depends_on_points:
            points = transformed(points, bones_from_model)
        influences = self.weighting.influences_over_joints(points)
        provider = PROVIDERS[method]
        values, points, triangles = dict(self._parameters[method]), self.points, self.triangles
        if provider.welds and values.pop("weld"):
            entry.weld = weld(points, [influences])
        if entry.weld is not None:
            points, influences = points[entry.weld.first], influences.of_vertices(entry.weld.first)
            triangles = entry.weld.triangles(triangles)
        entry.key = _key(method, provider.version, values, points, influences, triangles)
        arrays = (points, influences.offsets, influences.bones, influences.weights, triangles)
        entry.start = partial(provider.start, *arrays, **values)
        found = self._stored.get(entry.key)
        if found is None:
            found = precomputations.find(entry.key)
        if found is not None and _fits(METHODS[method], found, points, influences):
            self._put(entry, found)
        elif found is not None:
            log.warning("The stored %s of a mesh are damaged; they are computed anew", provider.what)
        return entry.start

    def _put(self, entry: _Entry, made: np.ndarray) -> None:
        entry.computed, entry.is_outdated = made, False
        entry.made = made if entry.weld is None else entry.weld.rows_of_vertices(made)
        self.version = next(_versions)


def _fits(method: sinew.Method, found: np.ndarray, points: np.ndarray, influences: Influences) -> bool:
    """Whether stored data can be that of the mesh: centres and first moments are means of the rest points."""
    rows = len(found) if method.rows_by_bone else len(points)
    if found.shape != (rows, method.vertex_floats) or found.dtype != np.float32:
        return False
    weighted = np.unique(owners_of(influences.counts)[influences.weights > 0])
    if not len(found):
        return not len(points) or not len(weighted)
    lowest, highest = points.min(axis=0), points.max(axis=0)
    diagonal = float(np.linalg.norm(highest - lowest))
    margin = 1e-3 * diagonal + 1e-6 * float(np.abs(points).max())
    weights, means, squares = np.ones((rows, 1)), found[:, :3], found[:, 3:]
    if method.rows_by_bone:
        vertices, bones, weights = found[:, 0], found[:, 1], found[:, 2:3]
        means, squares = found[:, 3:6], found[:, 6:]
        is_sound = bool(
            np.array_equal(vertices, np.floor(vertices))
            and np.isin(bones, influences.bones).all()
            and (np.diff(vertices) >= 0).all()
            and 0 <= vertices[0] <= vertices[-1] < len(points)
            and ((weights > 0) & (weights <= 1.001)).all()
            and np.isin(weighted, vertices).all()
        )
        if not is_sound:
            return False
    # Comparisons with values that are not finite are false.
    are_inside = (means >= weights * lowest - margin) & (means <= weights * highest + margin)
    return bool(are_inside.all() and (np.abs(squares) <= diagonal**2 + margin).all())


def _values_of(method: str, values: Mapping[str, Value]) -> dict[str, float]:
    """Returns values by the ids of parameters, rounded as Blender's properties are, so that a default equals
    the stored value."""
    defaults = {each.id: each.default for each in METHODS[method].parameters}
    names = PROVIDERS[method].parameters
    return {name: float(np.float32(values.get(f"{method}.{name}", defaults[name]))) for name in names}


def _key(
    method: str,
    version: int,
    values: Mapping[str, float],
    points: np.ndarray,
    influences: Influences,
    triangles: np.ndarray,
) -> str:
    """Returns the hash of everything that the data of a method is computed from."""
    of_method = " ".join([method, str(version), *map(repr, values.values())])
    digest = hashlib.blake2b(of_method.encode(), digest_size=16)
    for array in (points, influences.offsets, influences.bones, influences.weights, triangles):
        digest.update(f" {array.dtype.str} {array.shape} ".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
