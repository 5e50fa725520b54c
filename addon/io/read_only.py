# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps Blender from writing where an open file says: commands only read their inputs.

Blender writes the disk caches of simulations whenever it evaluates a frame, and File Output nodes write with
each picture. Text blocks and handlers of the file do not run. Anything else that a file could have written
takes an operator that no command calls.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from .actions import animated_paths

# Blender reads caches that are marked as baked, and neither writes nor removes them: the session_uid of their
# objects or scenes, each with a number among its caches.
_marked: set[tuple[int, int]] = set()
# Fluid domains that get another folder: session_uid and modifier, with the folder of the file. Blender
# removes files where another setting of their caches is changed.
_moved: dict[tuple[int, str], str] = {}


@contextmanager
def opening() -> Iterator[list[str]]:
    """Context in which a file is opened: its caches are protected before Blender first evaluates it, and from
    then on, but not in files that are saved. Yields a list that gets a sentence for each simulation that is
    only read."""
    sentences: list[str] = []

    @persistent
    def protect(*_args: object) -> None:
        sentences.extend(_protect_all())

    _forget()
    # Before Sinew's own, which evaluates the file.
    bpy.app.handlers.load_post.insert(0, protect)
    try:
        yield sentences
    finally:
        bpy.app.handlers.load_post.remove(protect)


def prepare_render() -> None:
    """Removes from all scenes what writes files along with a picture. The open file must not be saved
    afterwards."""
    trees = [getattr(scene, "node_tree", None) for scene in bpy.data.scenes]  # of their own until 5.0
    for tree in filter(None, (*trees, *bpy.data.node_groups)):
        for node in [node for node in tree.nodes if node.type == "OUTPUT_FILE"]:
            tree.nodes.remove(node)
    for scene in bpy.data.scenes:
        # Copies of results, and of textures (since 5.2).
        for name in ("use_render_cache", "use_auto_generate_texture_cache"):
            if hasattr(scene.render, name):
                setattr(scene.render, name, False)
        if hasattr(scene, "cycles"):
            # Script nodes of Cycles can write files.
            scene.cycles.shading_system = False


def _protect_all() -> list[str]:
    sentences = []
    for owner in _owners():
        uid = owner.session_uid
        caches = {
            (uid, number)
            for number, cache in enumerate(_caches_of(owner))
            if not cache.is_baked and (cache.use_disk_cache or cache.use_external or _is_keyed(owner))
        }
        domains = {
            (uid, modifier.name): modifier.domain_settings.cache_directory
            for modifier in _domains_of(owner)
            if modifier.domain_settings.cache_type == "REPLAY" or modifier.domain_settings.is_cache_baking_any
        }
        _marked.update(caches)
        _moved.update(domains)
        if caches:
            sentences.append(
                f"{owner.name}: its simulation is read from the cache on the disk and does not run; bake it "
                "in Blender if frames are missing"
            )
        if domains:
            sentences.append(
                f"{owner.name}: its fluid is not baked, and is simulated anew; bake it in Blender"
            )
    if _marked or _moved:
        _protect()
        bpy.app.handlers.save_pre.append(_release)
        for event in (bpy.app.handlers.save_post, bpy.app.handlers.save_post_fail):
            event.insert(0, _protect)
    return sentences


def _owners() -> list[bpy.types.Object | bpy.types.Scene]:
    """Returns what can have caches. Blender itself writes none of linked data."""
    return [owner for owner in (*bpy.data.objects, *bpy.data.scenes) if owner.library is None]


def _is_keyed(owner: bpy.types.Object | bpy.types.Scene) -> bool:
    """Whether keys or drivers can switch a disk cache on."""
    return any(path.endswith((".use_disk_cache", ".use_external")) for path in animated_paths(owner))


def _caches_of(owner: bpy.types.Object | bpy.types.Scene) -> Iterator[bpy.types.PointCache]:
    """Yields all caches that an owner can use: one of each list, which an animation can choose."""
    for user in _users_of_caches(owner):
        every = user.point_cache.point_caches
        used = every.active_index
        for index in range(len(every)):
            if index != user.point_cache.point_caches.active_index:
                user.point_cache.point_caches.active_index = index
            yield user.point_cache
        if used != user.point_cache.point_caches.active_index:
            user.point_cache.point_caches.active_index = used


def _users_of_caches(owner: bpy.types.Object | bpy.types.Scene) -> Iterator[bpy.types.bpy_struct]:
    if isinstance(owner, bpy.types.Scene):
        if owner.rigidbody_world is not None:
            yield owner.rigidbody_world
        return
    yield from owner.particle_systems
    for modifier in owner.modifiers:
        if modifier.type in ("CLOTH", "SOFT_BODY"):
            yield modifier
        elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings is not None:
            yield from modifier.canvas_settings.canvas_surfaces


def _domains_of(owner: bpy.types.Object | bpy.types.Scene) -> Iterator[bpy.types.FluidModifier]:
    for modifier in getattr(owner, "modifiers", ()):
        if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN":
            yield modifier


@persistent
def _protect(*_args: object) -> None:
    _mark(bpy.ops.ptcache.bake_from_cache)
    for number, (domain, _folder) in enumerate(_moved_domains()):
        domain.cache_directory = str(Path(bpy.app.tempdir, f"fluid{number}"))


@persistent
def _release(*_args: object) -> None:
    _mark(bpy.ops.ptcache.free_bake)
    for domain, folder in _moved_domains():
        domain.cache_directory = folder


def _moved_domains() -> Iterator[tuple[bpy.types.FluidDomainSettings, str]]:
    for owner in _owners() if _moved else ():
        for modifier in _domains_of(owner):
            folder = _moved.get((owner.session_uid, modifier.name))
            if folder is not None:
                yield modifier.domain_settings, folder


def _mark(operator: Callable[[], object]) -> None:
    """Calls an operator that marks a cache, or takes the mark away, and changes nothing else.

    Blender evaluates the context's scene before and after each operator, while caches are not protected: so
    the context has an empty one.
    """
    if not _marked:
        return
    empty = bpy.data.scenes.new("Sinew Empty")
    layer = empty.view_layers[0]
    try:
        for owner in _owners():
            for number, cache in enumerate(_caches_of(owner)):
                if (owner.session_uid, number) in _marked:
                    with bpy.context.temp_override(scene=empty, view_layer=layer, point_cache=cache):
                        operator()
    finally:
        bpy.data.scenes.remove(empty)


def _forget() -> None:
    _marked.clear()
    _moved.clear()
    for event in ("save_pre", "save_post", "save_post_fail"):
        functions = getattr(bpy.app.handlers, event)
        for function in (_release, _protect):
            if function in functions:
                functions.remove(function)
