# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures rendered with Sinew equal those rendered with the Armature modifier."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
import pytest
import scenes
from mathutils import Matrix
from sinew_addon.attach import properties
from sinew_addon.deform import safe_mode, small_meshes

SIZE = 96


def prepare(scene: bpy.types.Scene, motion_blur: bool) -> None:
    """Cycles with the same noise in each run: one seed, no denoiser."""
    scene.camera = camera = scenes.added("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 3.0
    camera.matrix_world = Matrix.Translation((1.0, 0.0, 5.0))
    sun = scenes.added("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (0.5, 0.3, 0.0)
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", 16, 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = motion_blur, 1.0
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format = "PNG"


def render_animation(scene: bpy.types.Scene, folder, frames: tuple[int, int]) -> np.ndarray:
    """[frames, height, width, 4]: an animation rendered in the background, read back from its files."""
    scene.frame_start, scene.frame_end = frames
    scene.render.filepath = f"{folder}/"
    bpy.ops.render.render(animation=True)
    return np.stack([scenes.pixels_of(path) for path in sorted(folder.glob("*.png"))])


def with_and_without(
    folder,
    obj: bpy.types.Object,
    method: str,
    frames: tuple[int, int],
    change: Callable[[], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The frames rendered with Sinew, and before that with the Armature modifier.

    change  called once Sinew is on the object
    """
    scene = bpy.context.scene
    (folder / "modifier").mkdir()
    (folder / "sinew").mkdir()
    expected = render_animation(scene, folder / "modifier", frames)
    scenes.add_sinew(obj, method)
    if change is not None:
        change()
    return render_animation(scene, folder / "sinew", frames), expected


@pytest.mark.parametrize("motion_blur", [False, True], ids=["sharp", "motion blur"])
@pytest.mark.parametrize(("method", "preserve_volume"), [("lbs", False), ("dq", True)])
def test_background_animation_equals_the_modifier(tmp_path, method, preserve_volume, motion_blur):
    obj, _armature = scenes.make_arm()
    scene = bpy.context.scene
    prepare(scene, motion_blur)
    obj.modifiers["Armature"].use_deform_preserve_volume = preserve_volume
    got, expected = with_and_without(tmp_path, obj, method, (5, 7))
    assert np.abs(expected[0] - expected[2]).mean() > 0.005, "nothing moves: nothing is tested"
    # Points equal to 1e-6 occasionally still move a sample across a silhouette.
    assert np.abs(got - expected).mean() < 2e-4


def moving_parent(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    obj.parent = armature
    scenes.key(armature, "location", ((1, (0.0, 0.0, 0.0)), (11, (0.5, 0.5, 0.0))))
    obj.modifiers.new("Behind", "SUBSURF").render_levels = 1


def in_front(obj: bpy.types.Object, _armature: bpy.types.Object) -> None:
    scenes.put_in_front(obj).render_levels = 2


def second_view_layer(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Two view layers; the rig is hidden in one of them."""
    scene = bpy.context.scene
    collection = bpy.data.collections.new("Rig")
    scene.collection.children.link(collection)
    scene.collection.objects.unlink(armature)
    collection.objects.link(armature)
    other = scene.view_layers.new("Other")
    other.layer_collection.children["Rig"].exclude = True
    moving_parent(obj, armature)


def persistent_data(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    bpy.context.scene.render.use_persistent_data = True
    in_front(obj, armature)


def workbench(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    moving_parent(obj, armature)


def eevee(obj: bpy.types.Object, armature: bpy.types.Object) -> None:
    if bpy.app.version < (5, 2, 0) or not bpy.context.scene.render.use_motion_blur:
        pytest.skip("EEVEE takes long without a graphics card: rendered by the newest Blender only, blurred")
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    bpy.context.scene.eevee.taa_render_samples = 1
    moving_parent(obj, armature)


@pytest.mark.slow
@pytest.mark.parametrize("motion_blur", [False, True], ids=["sharp", "motion blur"])
@pytest.mark.parametrize(
    "set_up",
    [moving_parent, in_front, second_view_layer, persistent_data, workbench, eevee],
    ids=lambda f: f.__name__,
)
def test_set_ups_render_like_the_modifier(tmp_path, set_up, motion_blur):
    obj, armature = scenes.make_arm()
    scene = bpy.context.scene
    prepare(scene, motion_blur)
    set_up(obj, armature)
    got, expected = with_and_without(tmp_path, obj, "lbs", (5, 7))
    assert np.abs(expected[0] - expected[2]).mean() > 0.002, "nothing moves: nothing is tested"
    assert np.abs(got - expected).mean() < 3e-4


def test_renders_animate_modifiers_behind_and_other_users_of_the_mesh(tmp_path):
    obj, armature = scenes.make_arm()
    scene = bpy.context.scene
    prepare(scene, motion_blur=False)
    moving_parent(obj, armature)
    other = scenes.copied(obj, linked=True)
    other.location.y += 1.0
    behind = obj.modifiers.new("Cast", "CAST")
    flags = other.modifiers["Armature"]
    scenes.key(behind, "factor", ((1, 0.0), (4, 1.0)))
    scenes.key(flags, "show_render", ((1, False), (4, True)))
    scene.frame_set(1)
    got, expected = with_and_without(tmp_path, obj, "lbs", (5, 7))
    assert np.abs(got - expected).mean() < 3e-4


@pytest.fixture(params=["after the update", "with a modifier", "compared"])
def keyed(request, monkeypatch) -> tuple[bpy.types.Object, Callable[[], None]]:
    """An arm with a keyed shape key, and a function that turns Sinew on, deforming it or copies after the
    update."""
    obj, _armature = scenes.make_arm()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Key")
    for point in key.data[: len(key.data) // 2]:
        point.co.y += 0.8
    scenes.key(key, "value", ((5, 0.0), (9, 1.0)))
    if request.param == "with a modifier":
        behind = obj.modifiers.new("Cast", "CAST")
        scenes.key(behind, "factor", ((5, 0.0), (9, 1.0)))
    monkeypatch.setattr(small_meshes, "is_used", request.param == "compared")

    def add() -> None:
        if not properties.has_sinew(obj):
            scenes.add_sinew(obj, "lbs")
        if request.param == "compared":
            bpy.ops.sinew.compare(methods={"qv"})
            for copy in filter(properties.is_copy, bpy.data.objects):
                # It is rendered, but not visible.
                copy.location.z -= 100.0
        # From the second change of frame on, Sinew knows that they change its shape.
        for frame in (9, 10, 11):
            bpy.context.scene.frame_set(frame)

    safe_mode.set_forced(request.param != "compared" or None)
    yield obj, add
    safe_mode.set_forced(None)


def test_keys_of_shape_keys_are_rendered(tmp_path, keyed):
    obj, add = keyed
    prepare(bpy.context.scene, motion_blur=False)
    got, expected = with_and_without(tmp_path, obj, "lbs", (5, 7), add)
    assert np.abs(expected[0] - expected[2]).mean() > 0.002, "nothing moves: nothing is tested"
    assert np.abs(got - expected).mean() < 3e-4


def test_keys_of_shape_keys_are_exported(tmp_path, keyed):
    """An exporter has its own evaluation, like a render, but sends no notification."""
    obj, add = keyed
    add()
    name, path, frames = obj.name, tmp_path / "arm.abc", [5, 7, 9]
    bpy.ops.wm.alembic_export(filepath=str(path), start=5, end=9)
    expected = scenes.shapes(obj, frames)
    assert scenes.worst(expected[0], expected[1]) > 0.1
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.alembic_import(filepath=str(path))
    assert scenes.worst(scenes.shapes(bpy.data.objects[name], frames), expected) <= 1e-6


def test_keys_of_settings_and_of_modifiers_behind_are_rendered(tmp_path):
    """Blender shows another frame than the rendered one."""
    obj, _armature = scenes.make_arm()
    scene = bpy.context.scene
    prepare(scene, motion_blur=False)
    flag, cast = obj.modifiers["Armature"], obj.modifiers.new("Cast", "CAST")
    scenes.key(flag, "use_deform_preserve_volume", ((8, False), (9, True)))
    scenes.key(cast, "factor", ((8, 0.0), (9, 1.0)))
    scene.frame_set(11)

    def key_method() -> None:
        scenes.key(properties.of(obj), "method", ((8, "lbs"), (9, "dq")))
        scene.frame_set(11)

    got, expected = with_and_without(tmp_path, obj, "dq", (5, 7), key_method)
    assert np.abs(got - expected).mean() < 3e-4
