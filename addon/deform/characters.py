# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts methods on meshes, and reads the final points of evaluated meshes."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

import bpy
import numpy as np

from ..attach import attach, properties, setting_animation, variant_settings
from ..base import interrupt
from ..base.errors import SinewError, WrongUse
from ..io import mesh_io
from ..skinning import parameters
from ..skinning.parameters import Value
from ..skinning.variants import BLENDER, FILE, Variant
from ..skinning.vectors import transformed_axes
from . import lifecycle, session


def method_names() -> list[str]:
    return [*properties.METHODS, BLENDER]


def check_methods(names: Iterable[str], more: Iterable[str] = ()) -> None:
    """more: names beside those of method_names()."""
    known = [*method_names(), *more]
    for name in names:
        if name not in known:
            raise WrongUse(f"method: expected one of {', '.join(known)}, got {name!r}")


def deformed_meshes(scene: bpy.types.Scene, name: str | None = None) -> list[bpy.types.Object]:
    """Returns the scene's meshes that an armature deforms, all or the one called `name`, and makes them
    visible, as Blender does not evaluate hidden objects. Raises SinewError where there are none."""
    meshes = attach.deformed_meshes(list(scene.objects))
    if name is not None:
        meshes = [obj for obj in meshes if obj.name == name]
    if not meshes:
        what = (
            f"no mesh called {name!r} that an armature deforms"
            if name
            else "no mesh is deformed by an armature"
        )
        raise SinewError(what)
    show(meshes)
    return meshes


def show(meshes: list[bpy.types.Object]) -> None:
    """Makes meshes of the scene visible, with the collections that they are in."""
    for layer in _layers(bpy.context.view_layer.layer_collection):
        layer.exclude = layer.hide_viewport = False
        layer.collection.hide_viewport = layer.collection.hide_render = False
    for obj in meshes:
        obj.hide_viewport = False
        obj.hide_render = False
        if obj.name in bpy.context.view_layer.objects:
            obj.hide_set(False)
    # Copies of a comparison stay hidden, though their collection is now shown.
    for copy in filter(properties.is_copy, bpy.context.scene.objects):
        copy.hide_viewport = copy.hide_render = True


@contextmanager
def shown(meshes: list[bpy.types.Object]) -> Iterator[None]:
    """Context in which meshes of the scene are visible as by show(); afterwards they are as before."""
    layers = list(_layers(bpy.context.view_layer.layer_collection))
    flags = [
        *((layer, name, getattr(layer, name)) for layer in layers for name in ("exclude", "hide_viewport")),
        *(
            (owner, name, getattr(owner, name))
            for owner in (*(layer.collection for layer in layers), *meshes)
            for name in ("hide_viewport", "hide_render")
        ),
    ]
    hidden = [obj for obj in meshes if obj.hide_get()]
    show(meshes)
    try:
        yield
    finally:
        for obj in hidden:
            obj.hide_set(True)
        for owner, name, value in flags:
            if getattr(owner, name) != value:
                setattr(owner, name, value)


def use_method(obj: bpy.types.Object, method: str) -> None:
    """Deforms a mesh with one of method_names(). Raises SinewError where Sinew cannot deform it."""
    error = use_methods([(obj, method)])[0]
    if error is not None:
        raise error


def use_methods(wanted: Sequence[tuple[bpy.types.Object, str]]) -> list[SinewError | None]:
    """The same for many meshes, evaluated once, whatever their modifiers' icons say. Returns for each the
    error that prevents it, or None."""
    for obj, _method in wanted:
        if properties.has_sinew(obj) and obj.is_editable:
            attach.show(obj)
    return _use_methods(wanted, session.changing)


def use_methods_for_file(
    wanted: Sequence[tuple[bpy.types.Object, str]],
    scales: Mapping[bpy.types.Object, str | None],
    values: Mapping[bpy.types.Object, Mapping[str, Value]],
) -> list[SinewError | None]:
    """The same for a file that was opened to be saved so (see lifecycle.changing_for_file). Also sets
    parameters, and the scale rules by name, where None leaves an object its own."""
    return _use_methods(wanted, lifecycle.changing_for_file, scales, values)


def set_parameters(values: Mapping[str, Value]) -> None:
    """From now on every mesh that is given a method gets these values, as from parameters.parse()."""
    _values_of_all.clear()
    _values_of_all.update(values)


_values_of_all: dict[str, Value] = {}


Chosen: TypeAlias = tuple[str, Mapping[str, Value], str]
"""A method, values of parameters by their full names, and a sentence that says why."""

choosers: dict[str, Callable[[Sequence[bpy.types.Object]], Chosen]] = {}
"""For each of parameters.PRESETS, which may stand in the place of a method: chooses for the meshes of a
character, which are deformed by Sinew already."""

_kept: dict[str, dict[bpy.types.Object, tuple[str, Mapping[str, Value]]]] = {}
_own: dict[bpy.types.Object, dict[str, Value]] = {}


@contextmanager
def kept_choices(
    meshes: Sequence[bpy.types.Object],
    names: Iterable[str],
    variants: Mapping[str, Mapping[bpy.types.Object, Variant]] = MappingProxyType({}),
) -> Iterator[None]:
    """Context in which each preset among the names stands for what it chooses for the meshes at the
    beginning, each key of `variants` for these, and with every other method they have their own settings.

    Raises SinewError where it can not choose, or where a setting that it sets is keyed.
    """
    chosen: dict[str, dict[bpy.types.Object, tuple[str, Mapping[str, Value]]]] = {}
    presets = [name for name in names if name in choosers]
    try:
        for name in presets:
            found, set_by, failed = _with_presets([(obj, name) for obj in meshes], {})
            for error in failed.values():
                raise error
            chosen[name] = {
                obj: (method, variant_settings.with_parameters(obj, method, set_by[obj]))
                for obj, method in found
            }
        for key, of_meshes in variants.items():
            own = {obj: of_meshes[obj] for obj in meshes}
            chosen[key] = {
                obj: chosen.get(variant.method, {}).get(obj) or (variant.method, variant.assignments)
                for obj, variant in own.items()
            }
        for name, of_objects in chosen.items():
            for obj, (_method, values) in of_objects.items():
                keyed = setting_animation.keyed(obj, values)
                if keyed:
                    raise SinewError(f"{obj.name}: {keyed} is keyed; {name} can not be compared with it")
                _own.setdefault(obj, {}).update({each: variant_settings.stored(obj, each) for each in values})
        _kept.update(chosen)
        yield
    finally:
        _kept.clear()
        _own.clear()


def own_variants(meshes: Sequence[bpy.types.Object], variant: Variant) -> dict[bpy.types.Object, Variant]:
    """Returns the variant for each mesh; FILE stands for what each has now."""
    return {obj: variant_settings.read(obj) if variant.method == FILE else variant for obj in meshes}


def with_presets(variants: Mapping[bpy.types.Object, Variant]) -> dict[bpy.types.Object, Variant]:
    """Returns the same with what each preset chooses. Raises SinewError where it can not choose."""
    wanted = [(obj, variant.method) for obj, variant in variants.items() if variant.method in choosers]
    if not wanted:
        return dict(variants)
    found, values, failed = _with_presets(wanted, {})
    for error in failed.values():
        raise error
    whole = {obj: variant_settings.with_parameters(obj, method, values[obj]) for obj, method in found}
    return variants | {obj: Variant.of_values(method, whole[obj]) for obj, method in found}


# The method of meshes while a preset is being chosen.
_FIRST = "dq"
_sentences: list[str] = []


def sentences() -> list[str]:
    """Returns what presets chose since the last call, and why."""
    found = list(dict.fromkeys(_sentences))
    _sentences.clear()
    return found


def _with_presets(
    wanted: Sequence[tuple[bpy.types.Object, str]], values: Mapping[bpy.types.Object, Mapping[str, Value]]
) -> tuple[
    Sequence[tuple[bpy.types.Object, str]],
    Mapping[bpy.types.Object, Mapping[str, Value]],
    dict[bpy.types.Object, SinewError],
]:
    """Returns the same with methods and values in the place of presets, and the errors of meshes that none
    can be chosen for."""
    if _own:
        kept = {obj: _kept.get(method, {}).get(obj, (method, _own[obj])) for obj, method in wanted}
        own = {obj: {**kept[obj][1], **values.get(obj, _values_of_all)} for obj, _method in wanted}
        return [(obj, kept[obj][0]) for obj, _method in wanted], own, {}
    named = {obj: method for obj, method in wanted if method in choosers}
    if not named:
        return wanted, values, {}
    nothing: dict[bpy.types.Object, dict[str, Value]] = {obj: {} for obj in named}
    errors = _use_methods([(obj, _FIRST) for obj in named], session.changing, values=nothing)
    failed = {obj: error for obj, error in zip(named, errors, strict=True) if error is not None}
    characters: dict[tuple[str, bpy.types.Object | None], list[bpy.types.Object]] = {}
    for obj, preset in named.items():
        if obj not in failed:
            characters.setdefault((preset, attach.armature_of(obj)), []).append(obj)
    chosen: dict[bpy.types.Object, Chosen] = {}
    for (preset, _armature), meshes in characters.items():
        try:
            with shown([obj for obj in meshes if obj.name in bpy.context.scene.objects]):
                choice = choosers[preset](meshes)
        except SinewError as error:
            failed |= dict.fromkeys(meshes, error)
            continue
        chosen |= dict.fromkeys(meshes, choice)
        _sentences.append(f"{', '.join(obj.name for obj in meshes)}: {choice[2]}")
    given = {obj: values.get(obj, _values_of_all) for obj, _method in wanted}
    found = [(obj, chosen[obj][0] if obj in chosen else method) for obj, method in wanted]
    return (
        found,
        {obj: {**chosen[obj][1], **own} if obj in chosen else own for obj, own in given.items()},
        failed,
    )


def _use_methods(
    wanted: Sequence[tuple[bpy.types.Object, str]],
    changing: Callable[[bpy.types.Context], AbstractContextManager[None]],
    scales: Mapping[bpy.types.Object, str | None] = MappingProxyType({}),
    values: Mapping[bpy.types.Object, Mapping[str, Value]] = MappingProxyType({}),
) -> list[SinewError | None]:
    errors: list[SinewError | None] = []
    wanted, values, failed = _with_presets(wanted, values)
    with changing(bpy.context):
        for obj, method in wanted:
            try:
                if obj in failed:
                    raise failed[obj]
                _choose(obj, method, values.get(obj, _values_of_all))
                if scales.get(obj) is not None:
                    # As for the method: what the caller asks for overrides keys in the file.
                    setting_animation.remove_keys(obj, "sinew.scale_rule")
                    properties.of(obj).scale_rule = scales[obj]
                errors.append(None)
            except SinewError as error:
                errors.append(error)
    # It may have ended what methods need computed.
    interrupt.check()
    for index, (obj, method) in enumerate(wanted):
        if errors[index] is None and method != BLENDER and session.error_of(obj):
            errors[index] = SinewError(session.error_of(obj))
    return errors


def _choose(obj: bpy.types.Object, method: str, values: Mapping[str, Value]) -> None:
    if method == BLENDER:
        if properties.has_sinew(obj):
            properties.of(obj).enabled = False
        return
    _check_groups(values)
    attach.add(obj, method)
    # What the caller asks for overrides keys in the file.
    setting_animation.remove_keys(obj, "sinew.method")
    properties.of(obj).method = method
    for name, value in values.items():
        setting_animation.remove_keys(obj, f"sinew.{name}")
        variant_settings.assign(obj, name, value)
    if not properties.of(obj).enabled:
        properties.of(obj).enabled = True


def _check_groups(values: Mapping[str, Value]) -> None:
    """Raises SinewError for a vertex group that no mesh of the file has; some meshes may lack it."""
    known = parameters.by_full_name()
    for name, value in values.items():
        if name in known and known[name].kind == "vertex_group" and value:
            meshes = [obj for obj in bpy.data.objects if obj.type == "MESH"]
            if not any(value in mesh.vertex_groups for mesh in meshes):
                raise SinewError(f"{name}: no mesh has a vertex group {value!r}")


def use_method_on(meshes: Iterable[bpy.types.Object], method: str) -> None:
    for error in use_methods([(obj, method) for obj in meshes]):
        if error is not None:
            raise error


def deformable_meshes(
    scene: bpy.types.Scene, path: Path, methods: Iterable[str], name: str | None = None
) -> tuple[list[bpy.types.Object], list[str]]:
    """Returns those of deformed_meshes() that all `methods` can deform, and a sentence for each of the
    others.

    Raises SinewError that names the file `path` where there is none.
    """
    return taken(deformed_meshes_of(scene, path, name), path, methods)


def deformed_meshes_of(scene: bpy.types.Scene, path: Path, name: str | None = None) -> list[bpy.types.Object]:
    """The same as deformed_meshes(); an error names the file."""
    try:
        return deformed_meshes(scene, name)
    except SinewError as error:
        raise SinewError(f"{path}: {error}") from None


def taken(
    meshes: Sequence[bpy.types.Object], path: Path, methods: Iterable[str]
) -> tuple[list[bpy.types.Object], list[str]]:
    """The same as deformable_meshes(), for some of deformed_meshes()."""
    methods = list(dict.fromkeys(_FIRST if method in choosers else method for method in methods))
    found, reasons = [], []
    for obj in meshes:
        try:
            for method in methods:
                use_method(obj, method)
            found.append(obj)
        except SinewError as error:
            reasons.append(str(error))
    if not found:
        raise SinewError(f"{path}: no mesh that Sinew can drive: {reasons[0]}")
    return found, reasons


def length_unit(scene: bpy.types.Scene) -> str:
    """The name of Blender's unit of length in the file: "m", or "units" where it is not a metre."""
    units = scene.unit_settings
    return "m" if units.system != "NONE" and units.scale_length == 1.0 else "units"


def set_frame(scene: bpy.types.Scene, frame: float) -> None:
    whole = int(np.floor(frame))
    scene.frame_set(whole, subframe=float(frame - whole))
    interrupt.check()


@contextmanager
def kept_frame(scene: bpy.types.Scene) -> Iterator[None]:
    """Context in which any frame can be set; afterwards the scene is at its own."""
    frame = scene.frame_float
    try:
        yield
    finally:
        set_frame(scene, frame)


@contextmanager
def at_rest(armatures: Iterable[bpy.types.Object]) -> Iterator[None]:
    """Context in which armatures are in their rest position, so that nothing is deformed by them."""
    before = {armature.data: armature.data.pose_position for armature in armatures}
    try:
        for data in before:
            data.pose_position = "REST"
        bpy.context.view_layer.update()
        yield
    finally:
        for data, position in before.items():
            data.pose_position = position
        bpy.context.view_layer.update()


def final_points(obj: bpy.types.Object) -> np.ndarray:
    """Vertices of the final evaluated mesh, object space, float32 [vertices, 3]."""
    return mesh_io.read_points(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def world_points(objects: list[bpy.types.Object]) -> np.ndarray:
    """Final vertices of several meshes, concatenated, in world space, float64 [vertices, 3]; stored axis by
    axis, as measuring needs them."""
    parts = []
    for obj in objects:
        matrix = np.array(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
        parts.append(transformed_axes(final_points(obj), matrix))
    return np.concatenate(parts, axis=1).T


def _layers(layer: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    """The layer and all below it, parents first."""
    yield layer
    for child in layer.children:
        yield from _layers(child)
