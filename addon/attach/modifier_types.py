# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's types of modifiers do to a mesh."""

# These change no positions, topology or weights, so they may be before the Armature modifier.
HARMLESS_UPSTREAM = {"NORMAL_EDIT", "UV_PROJECT", "UV_WARP", "WEIGHTED_NORMAL"}

# In the paint modes Blender leaves out modifiers that do not say which vertex of the mesh each of their
# vertices comes from (measured on 4.2 and 5.2).
LEFT_OUT_IN_PAINT = {
    "BEVEL",
    "BOOLEAN",
    "BUILD",
    "DECIMATE",
    "OCEAN",
    "REMESH",
    "SCREW",
    "SKIN",
    "VOLUME_TO_MESH",
    "WIREFRAME",
}
PAINT_MODES = ("WEIGHT_PAINT", "VERTEX_PAINT")

# Blender permits no modifier that does more than deform in front of these, and puts a new one in front of it.
NEED_ORIGINAL_MESH = {"MULTIRES", "SOFT_BODY"}
# Behind these alone, Blender knows that the mesh is only deformed.
ONLY_DEFORM = {
    "ARMATURE",
    "CAST",
    "CLOTH",
    "COLLISION",
    "CORRECTIVE_SMOOTH",
    "CURVE",
    "DISPLACE",
    "HOOK",
    "LAPLACIANDEFORM",
    "LAPLACIANSMOOTH",
    "LATTICE",
    "MESH_CACHE",
    "MESH_DEFORM",
    "PARTICLE_SYSTEM",
    "SHRINKWRAP",
    "SIMPLE_DEFORM",
    "SMOOTH",
    "SURFACE",
    "SURFACE_DEFORM",
    "WARP",
    "WAVE",
}
