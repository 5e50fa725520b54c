# SPDX-License-Identifier: GPL-3.0-or-later
"""Sinew in Blender's menus, tooltips, manual and presets; test_panel_in_window.py clicks on them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import bpy
import five_meshes
import pytest
from bl_operators.wm import WM_OT_doc_view_manual
from sinew_addon.attach import properties
from sinew_addon.ui import character, manual, menus

pytestmark = pytest.mark.long_term


def operator_types() -> Iterator[tuple[type, bpy.types.Struct]]:
    for name in dir(bpy.ops.sinew):
        yield getattr(bpy.types, f"SINEW_OT_{name}"), getattr(bpy.ops.sinew, name).get_rna_type()


def groups() -> list[type]:
    found = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__.startswith("Sinew")]
    return [cls for cls in found if cls.is_registered]


def shown_properties() -> Iterator[tuple[str, bpy.types.Property]]:
    """The full name of each property that users see."""
    for cls, rna in operator_types():
        for prop in rna.properties:
            if prop.identifier != "rna_type" and not prop.is_hidden:
                yield f"bpy.ops.{cls.bl_idname}.{prop.identifier}", prop
    for cls in groups():
        for prop in cls.bl_rna.properties:
            if prop.identifier not in ("rna_type", "name") and not prop.is_hidden:
                yield f"bpy.types.{cls.__name__}.{prop.identifier}", prop


def test_every_button_and_choice_has_a_tooltip():
    assert len(groups()) > 5
    missing = [cls.bl_idname for cls, rna in operator_types() if not rna.description]
    for name, prop in shown_properties():
        missing += [name] if not prop.description else []
        for item in prop.enum_items if prop.type == "ENUM" else ():
            # An entry without an identifier is a heading.
            missing += [f"{name}: {item.identifier}"] if item.identifier and not item.description else []
    assert missing == []


def test_every_operator_is_in_the_menu_but_those_of_a_single_button():
    listed = {entry.operator for entry in menus.entries()}
    known = {f"sinew.{name}" for name in dir(bpy.ops.sinew)}
    inner = {cls.bl_idname for cls, _rna in operator_types() if "INTERNAL" in cls.bl_options}
    assert listed == known - inner
    assert listed.isdisjoint(inner)


def test_entries_of_the_menu_have_values_that_the_operators_take():
    for entry in menus.entries():
        rna = getattr(bpy.ops.sinew, entry.operator.partition(".")[2]).get_rna_type()
        for name, value in entry.values.items():
            prop = rna.properties[name]
            if prop.type == "ENUM":
                assert value in [item.identifier for item in prop.enum_items]
            else:
                assert isinstance(value, {"STRING": str, "BOOLEAN": bool}[prop.type])
            if name == "stage":
                assert value in properties.STAGE_GROUPS


@pytest.mark.parametrize("menu", list(menus.MENUS))
def test_the_menus_have_it_until_sinew_goes(menu):
    functions = getattr(bpy.types, menu).draw._draw_funcs
    assert menus.MENUS[menu] in functions
    menus.FEATURE.unregister()
    assert menus.MENUS[menu] not in functions
    menus.FEATURE.register()


def test_the_manual_has_a_section_for_every_operator_and_property(monkeypatch):
    page = manual.PAGE.read_text()
    anchors = set(re.findall(r'id="([^"]+)"', page))
    names = [f"bpy.ops.{cls.bl_idname}" for cls, _rna in operator_types()]
    names += [name for name, _prop in shown_properties()]
    for name in names:
        address = WM_OT_doc_view_manual._lookup_rna_url(name, verbose=False)
        assert address is not None, name
        start, _sharp, anchor = address.partition("#")
        assert start == Path(manual.PAGE).as_uri()
        assert anchor in anchors, name
    assert WM_OT_doc_view_manual._lookup_rna_url("bpy.ops.sinew.compare", verbose=False).endswith("#compare")
    manual.FEATURE.unregister()
    assert WM_OT_doc_view_manual._lookup_rna_url("bpy.ops.sinew.compare", verbose=False) is None
    manual.FEATURE.register()


def test_a_preset_has_method_and_parameters_for_another_character(tmp_path, monkeypatch):
    monkeypatch.setenv("BLENDER_USER_SCRIPTS", str(tmp_path))
    five_meshes.make(vertices=240)
    bpy.ops.sinew.add(method="dq")
    shared = character.of(bpy.context.scene)
    shared.delta_mush.enabled, shared.delta_mush.iterations, shared.mix.method = True, 9, "lbs"
    shared.mix.group = "bone.1"
    folder = bpy.utils.user_resource("SCRIPTS", path="presets/sinew/methods", create=True)
    if not folder.startswith(str(tmp_path)):
        pytest.skip("this Blender does not look at BLENDER_USER_SCRIPTS any more once it runs")
    assert bpy.ops.sinew.method_preset_add(name="Soft Skin") == {"FINISHED"}
    (made,) = Path(folder).glob("*.py")
    text = made.read_text()
    assert "bone.1" not in text
    bpy.ops.sinew.remove()
    bpy.ops.sinew.add(method="qv")
    arguments = {"filepath": str(made), "menu_idname": "SINEW_PT_method_presets"}
    assert bpy.ops.sinew.method_preset(**arguments) == {"FINISHED"}
    for name in five_meshes.MESHES:
        settings = properties.of(bpy.data.objects[name])
        assert (settings.method, settings.mix.method) == ("dq", "lbs")
        assert (settings.delta_mush.enabled, settings.delta_mush.iterations) == (True, 9)
        assert settings.mix.group == ""
    bpy.ops.sinew.method_preset_add(name="Soft_Skin", remove_name=True)
    assert not made.exists()


def test_on_off_by_its_operator():
    five_meshes.make(vertices=240)
    bpy.ops.sinew.add()
    for expected in (False, True):
        bpy.ops.sinew.switch()
        assert {properties.of(bpy.data.objects[name]).enabled for name in five_meshes.MESHES} == {expected}
