# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds a mesh's vertex groups in Blender's memory.

Scripts can read them only vertex by vertex, through an object for each, which takes a hundred times as long.
And where a mesh shares them, as with its evaluated copy or an undo step, the first such look copies all of
them (seen on 4.2 to 5.3).
"""

import ctypes
from typing import NamedTuple

import bpy


class Offsets(NamedTuple):
    """Bytes in Blender's structures, as in the catalogue (DNA) of each blend file that this Blender writes.

    layers      Mesh: of the CustomData of vertices
    data        CustomDataLayer: of the pointer to its data
    layer_size  of CustomDataLayer
    """

    layers: int
    data: int
    layer_size: int


# By the first two numbers of Blender's version. Other versions are read vertex by vertex.
OFFSETS = {
    (4, 2): Offsets(264, 104, 128),
    (4, 3): Offsets(264, 104, 120),
    (4, 4): Offsets(264, 104, 120),
    (4, 5): Offsets(304, 104, 120),
    (5, 0): Offsets(480, 104, 120),
    (5, 1): Offsets(480, 96, 112),
    (5, 2): Offsets(480, 96, 112),
    (5, 3): Offsets(480, 96, 112),
}
# In CustomData, after the pointer to its layers; the same in all these versions.
LAYER_COUNT = 220
# The kind of a layer of vertex groups, at the start of CustomDataLayer (eCustomDataType).
CD_MDEFORMVERT = 2


def address_of_groups(mesh: bpy.types.Mesh) -> int | None:
    """Returns the address of the mesh's vertices with their groups, for sinew.weights_in_memory(); 0 where
    none has any; None in a Blender whose memory is not known."""
    offsets = OFFSETS.get(bpy.app.version[:2])
    if offsets is None:
        return None
    start = mesh.as_pointer() + offsets.layers
    layers, count = ctypes.c_void_p.from_address(start), ctypes.c_int.from_address(start + LAYER_COUNT)
    for number in range(count.value):
        layer = layers.value + number * offsets.layer_size
        if ctypes.c_int.from_address(layer).value == CD_MDEFORMVERT:
            return ctypes.c_void_p.from_address(layer + offsets.data).value or 0
    return 0
