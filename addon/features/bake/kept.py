# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh keeps of its last bake into its file: what was made, with its errors, and what deformed it
before, for Sinew on it once more."""

import json
from collections.abc import Sequence

import bpy

from ...attach import properties, property_groups, stage_settings, variant_settings
from ...base.phrases import Phrase, phrase
from ...skinning.variants import Variant, parse


class SinewBake(bpy.types.PropertyGroup):
    """
    sentences  phrases, as JSON: of each its template and its values
    variant    the text of what deformed it; empty: it was not baked
    groups     the vertex groups of stages, as JSON: their names by the stages'
    """

    sentences: bpy.props.StringProperty(options={"HIDDEN"}, description="What was made")
    variant: bpy.props.StringProperty(options={"HIDDEN"}, description="What deformed it before")
    groups: bpy.props.StringProperty(options={"HIDDEN"}, description="Vertex groups of stages before")


def note_variant(obj: bpy.types.Object) -> None:
    """Before Sinew is taken off."""
    groups = stage_settings.vertex_groups(properties.of(obj))
    obj.sinew_bake.variant = variant_settings.read(obj).text
    obj.sinew_bake.groups = json.dumps({stage: name for stage, name in groups.items() if name})


def note_sentences(obj: bpy.types.Object, sentences: Sequence[Phrase]) -> None:
    obj.sinew_bake.sentences = json.dumps([(each.template, each.values) for each in sentences])


def is_baked(obj: bpy.types.Object) -> bool:
    # Reading a group that an object lacks would make it.
    return obj.is_property_set("sinew_bake") and bool(obj.sinew_bake.variant)


def sentences_of(obj: bpy.types.Object) -> list[Phrase]:
    if not is_baked(obj) or not obj.sinew_bake.sentences:
        return []
    return [phrase(template, **values) for template, values in json.loads(obj.sinew_bake.sentences)]


def before(obj: bpy.types.Object) -> Variant | None:
    """Returns what deformed a mesh that has Sinew again before its bake; None where that is set, or there was
    no bake."""
    if not (is_baked(obj) and properties.has_sinew(obj)):
        return None
    variant = parse(obj.sinew_bake.variant)
    return None if variant.agrees_with(variant_settings.read(obj)) else variant


def use_before(obj: bpy.types.Object) -> None:
    """Sets what before() returns. The caller has it deformed."""
    variant = before(obj)
    if variant is None:
        return
    variant_settings.use([obj], variant)
    for stage, name in json.loads(obj.sinew_bake.groups).items():
        if name in obj.vertex_groups:
            property_groups.assign(getattr(properties.of(obj), stage), "group", name)
