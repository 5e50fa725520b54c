# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of a character that Sinew deforms, after each of which all meshes, renders and the file are as in a
Blender without Sinew. Each caused a fault once. walk_script says how they are written."""

from __future__ import annotations

import bpy
import pytest
import walk
import walk_script
from conftest import IS_NEWEST

CASES = {
    # Frames and poses
    "subframes": "add Arm; subframe 2 0.25; subframe 5 0.5; method Arm dq; subframe 9 0.75",
    "a moving armature": "key_object Rig 1 11; key_object Arm 2 9; add Arm; frame 3; frame 11; "
    "method Arm dq; frame 6",
    "posed by hand": "clear_animation Rig; add Arm; pose Rig lower; pose Rig upper; method Arm dq; "
    "pose Rig lower",
    "the rest position": "add Arm dq; frame 11; rest_position Rig; frame 6; rest_position Rig; update",
    "bendy bones of a hidden armature": "bone_options Rig upper segments 3; "
    "bone_options Rig lower segments 3; hide Rig viewport; hide Rig render; add Arm; frame 5; "
    "method Arm dq; frame 11; render 0.9",
    "modifiers behind": "add_modifier Arm SUBSURF 0.9; add_modifier Arm CAST 0.9; add Arm; frame 6; "
    "method Arm dq; frame 11; render 0.9",
    # Objects and meshes
    "the method of the modifier": "armature_options Arm volume; add Arm; frame 11; render",
    "an unkeyed move of a keyed object": "key_object Arm 2 9; frame 3; ~move_object Arm; add Arm; update; "
    "move_object Arm; add_modifier Arm CAST; update",
    "a linked duplicate with a pose of its own": "add Arm; duplicate_armature Rig; duplicate Arm; "
    "another_armature 'object 2' 'object 1'; frame 6; clear_animation 'object 1'; pose 'object 1' lower; "
    "frame 1; frame 11; enabled Arm; enabled Arm",
    "a duplicate renamed, its original deleted": "add Arm; duplicate Arm 0.9; rename_object Rig; "
    "rename_object 'object 1'; frame 4; delete_object Arm; frame 6; frame 11",
    "one user of a shared mesh in edit mode": "add Arm; duplicate Arm; frame 3; edit_mesh Arm nothing 0.9; "
    "frame 6; leave_mode; frame 11",
    "a linked duplicate made single": "add Arm; duplicate Arm; frame 3; swap_mesh 'object 1'; frame 6; "
    "remove_all",
    "nodes inside those of a heat map": "add Leg dq; heat Leg bulge; add Arm lbs; delete_points Arm nodes",
    "a heat map of a rig without size": "add Leg 0.9 cor; heat Leg bulge; no_size 'Other Rig' 2 4; "
    "no_size 'Other Rig' 3 4; no_size Leg 2 4",
    "hair of another beside a heat map": "add_shape_key Box; hair Box; add_modifier Box SOLIDIFY 0.9; "
    "add Arm dq; heat Arm; save_and_load; view_layer; delete_modifier Box 'Solidify 3'; "
    "shape_key_value Box 0.9 0.9",
    "a heat map of a shared mesh": "duplicate Arm; add Arm; frame 6; heat Arm; update; frame 7; "
    "heat Arm 0.9",
    "appended": "append; frame 2; frame 11",
    "appended, and off at once": "~append; enabled 'object 1'; frame 6",
    "a duplicate that is off, its original deleted": "duplicate Arm; add Arm dq; enabled Arm; duplicate Arm; "
    "delete_object Arm; remove 'object 2'; remove_all",
    "centres of a mesh that changes": "add Arm 0.9 cor; frame 8; move_vertices Arm; frame 9",
    "centres under shape keys": "add_shape_key Arm; key_shape_key Arm 1 11; add Arm 0.9 cor; frame 3; "
    "frame 9",
    "topology": "add Arm; frame 6; edit_mesh Arm subdivide; frame 11; edit_mesh Arm delete; frame 6",
    "weights": "add Arm; frame 11; weights Arm upper; frame 6; weights Arm lower; weights Arm hand 0.1; "
    "update",
    "without size": "add Arm; no_size Arm 0 6 1 11; no_size Rig 1 6 1 11; no_size Arm 2 6 1 11; frame 11",
    "without size, of an armature that moves no vertex": "add Arm dq; armature_options Arm groups; "
    "no_size Rig 1 1",
    "without size, masked": "armature_options Sleeve Armature mask lower; add Sleeve; no_size Rig 1 3",
    "without size, by dq": "add Arm dq; no_size Arm 1 6 1 11; no_size Rig 0 6 1 11; no_size Rig 3 6 1 11; "
    "frame 11",
    "without size, in a parent": "add Arm; parent Arm Rig OBJECT; no_size Rig 1 6 1 11; "
    "no_size Arm 0 6 1 11",
    "without size, of two armatures": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; "
    "no_size Rig 3 6 1 11; no_size 'Other Rig' 3 6 1 11; frame 11",
    "without size, by methods of Sinew's": "add Arm 0.9 qv; no_size Arm 1 6 1 11; method Arm 0.9 cor; "
    "no_size Arm 0 5 1 11; method Arm 0.9 ddm; no_size Rig 1 5 1 11; method Arm 0.9 dib; "
    "no_size Rig 0 5 1 11",
    # Comparisons
    "a comparison undone": "+add Arm dq; +frame 6; +compare Arm 2 lbs dq; undo; redo; frame 8; undo; "
    "frame 4; redo; end_comparison; remove_all",
    "a comparison saved": "add Arm dq; compare Arm 2 lbs dq; save_and_load; frame 6; end_comparison; "
    "save_and_load; frame 9; remove_all",
    "a comparison saved of what changes in front": "add_modifier Arm SUBSURF; add Arm; compare Arm 2 lbs dq; "
    "save_and_load; frame 6; end_comparison; remove_all",
    "a method keyed beside a comparison": "key_object Arm 2 9; add Arm 0.9 qv; compare Arm 1; "
    "key_method Arm 1 8 dq lbs; frame 5; remove Arm; add Arm 0.9 log; frame 6; end_comparison; remove_all",
    # Armatures
    "a deleted armature": "add Arm; add Leg; delete_armature Rig; frame 6; says Arm 'armature was deleted'; "
    "frame 11; remove Arm; frame 6",
    "an armature in no collection": "add Arm; unlink_armature Rig; frame 6; rebind Arm; frame 11",
    "the first of two armatures is deleted": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; frame 6; "
    "delete_armature Rig; update; frame 11",
    "the same with a heat map": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; heat Arm; "
    "delete_armature Rig; update; frame 11",
    "a hidden armature after off and on": "add Arm; enabled Arm; enabled Arm; hide Rig viewport; "
    "hide Rig render; frame 1; frame 11",
    "a bone made while Sinew is off": "add Arm; frame 4; enabled Arm; edit_bones Rig roll upper; "
    "edit_bones Rig new; enabled Arm; frame 6; frame 11",
    "bones are edited on the rest shape": "add Arm; frame 11; edit_bones Rig roll upper 0.3 0.9; "
    "leave_mode; frame 6",
    "undo in edit mode of a shared armature": "duplicate_armature Rig; another_armature Arm 'object 1'; "
    "add Arm; frame 11; edit_bones Rig new 0.3 0.9; undo; update; leave_mode; frame 6",
    "bones are edited twice": "add Arm; edit_bones Rig delete hand 0.9 0.9; groups Arm new; leave_mode; "
    "frame 6",
    # Shape keys
    "a shape key edited, added and removed": "add_shape_key Arm; add Arm; frame 6; shape_key_points Arm; "
    "add_shape_key Arm; frame 11; delete_shape_key Arm 0.9 'key 1'; frame 6; delete_shape_key Arm 0.1",
    "a slider and weights after it": "add_shape_key Arm; add Arm; frame 6; shape_key_value Arm; "
    "weights Arm lower",
    "the first shape keys": "add Arm; frame 6; add_shape_key Arm 0.9; frame 11",
    "a pinned shape key": "add_shape_key Arm; add Arm; frame 6; pin_shape_key Arm 1; pin_shape_key Arm 1; "
    "frame 11",
    "a muted pinned shape key": "add_shape_key Arm; add Arm; frame 6; shape_key_value Arm 0.9 0.1; "
    "pin_shape_key Arm 1; frame 11; pin_shape_key Arm 1",
    # Parts of Sinew
    **{
        f"Sinew's {part} taken away": f"add Arm dq; frame 6; frame 11; delete_points Arm {part}; update;"
        f"delete_points Arm {part}; frame 6; frame 11"
        for part in ("attribute", "group", "nodes", "links", "sockets", "driver")
    },
    "its sockets, while it is hidden": "add Arm dq; frame 11; hide Arm viewport; "
    "~delete_points Arm sockets; ~touch Arm; ik_chain Rig hand; hide Arm viewport; frame 6",
    "its sockets, while another is edited": "add Arm; add_modifier Arm DECIMATE; duplicate Arm 0.9 0.9; "
    "edit_mesh 'object 2' move 0.9; ~subframe 10 0.4; +delete_points Arm sockets; leave_mode; frame 5",
    "the same with a heat map, hidden": "add Arm dq; heat Arm; frame 11; hide Arm viewport; "
    "~delete_points Arm sockets; ~touch Arm; ik_chain Rig hand; hide Arm viewport; frame 6",
    "registered again at another frame": "add Arm dq; frame 8; restart 11; frame 3; frame 11",
    "registered again, keyed": "add Arm dq; key_method Arm 1 8 lbs dq; frame 9; restart 3; frame 3; frame 9",
    # Between a setting and a frame, before a frame, by others
    "weights after a method": "add Arm dq; frame 6; ~method Arm lbs; ~weights Arm lower; frame 10",
    "vertices after off and on": "add Arm dq; frame 6; ~enabled Arm; ~enabled Arm; ~move_vertices Arm; "
    "frame 10",
    "weights after a heat map": "add Arm dq; frame 6; ~heat Arm; ~weights Arm lower; frame 10",
    "vertices after a scale rule": "add Arm dq; frame 6; ~scale_rule Arm 1; ~move_vertices Arm; frame 10",
    "a group renamed before a frame": "add Arm dq; frame 6; ~groups Arm rename lower; frame 10",
    "weights of one with shape keys before a frame": "add_shape_key Arm; key_shape_key Arm 1 11; "
    "add Arm dq; frame 4; ~weights Arm lower; frame 5",
    "another renamed by a handler": "add Arm dq; neighbour Leg frame_change_post name 9; frame 6; "
    "neighbour Box depsgraph_update_post name 9; frame 9",
    "rendered while it is off": "add Arm dq; add Leg; render 0.9; add_shape_key Arm; "
    "key_shape_key Arm 1 10; frame 3; frame 4; enabled Arm; render 0.1 5; frame 6",
    "converted to a mesh": "add Arm dq; frame 6; convert_to_mesh Arm; frame 11; remove_all",
    "copied modifiers": "add Arm dq; add Leg; copy_modifiers Arm Box; frame 6; frame 11; remove Box",
    "copied modifiers of one that is off": "add Arm dq; enabled Arm; copy_modifiers Arm Box; frame 6; "
    "remove Box",
    "copied modifiers with keys": "key_visibility Arm 2 9 0.0; add Arm dq; frame 6; copy_modifiers Arm Box; "
    "remove Box; frame 11",
    "copied modifiers that keys hide": "duplicate Sleeve; key_visibility 'object 1' Armature 3 8; "
    "add 'object 1'; frame 5; copy_modifiers 'object 1' Sleeve; frame 8; method Sleeve dq; remove Sleeve",
    "copied modifiers with a mix": "add Arm; stages Arm 1; copy_modifiers Arm Box; frame 6; frame 11",
    "decimated while its weights are painted": "add_modifier Arm DECIMATE; add Arm dq; frame 8; "
    "paint_weights Arm smooth 0.9; frame 6; leave_mode; frame 8",
    "normalised while it is painted": "add Arm; groups Arm new; paint_weights Arm normalize_all 0 0.9; "
    "frame 6; leave_mode; frame 8",
    "absolute keys in weight paint": "key_visibility Arm 1 5 1.0; add_shape_key Arm; add Arm dq; "
    "sculpt_mode Arm 0.9; absolute_shape_keys Arm; paint_weights Arm smooth 0.9; leave_mode; frame 6",
    "saved behind a simulation": "add Arm dq; hair Arm FACE; move_modifier Arm 'Hair 1' Armature; frame 4; "
    "save; save_and_load; move_modifier Arm Armature 'Hair 1'; frame 6; save",
    "saved with its nodes taken apart": "add Arm dq; frame 6; ~delete_points Arm links; save; frame 8; "
    "frame 9",
    # Keys of visibility
    "deleted keys, on": "key_visibility Arm 1 5 0.0; frame 11; add Arm; frame 4; clear_animation Arm; "
    "frame 6",
    "deleted keys, off": "key_visibility Arm 1 5 0.0; frame 11; add Arm; frame 4; clear_animation Arm; "
    "enabled Arm; frame 6",
    "deleted keys, removed": "key_visibility Arm 1 5 0.0; frame 11; add Arm; frame 4; clear_animation Arm; "
    "remove Arm; frame 6",
    "deleted keys where the modifier is on": "key_visibility Arm 1 8 0.0; add Arm dq; frame 6; frame 8; "
    "clear_animation Arm; frame 8; frame 11",
    "keys on a hidden object": "add Arm; hide Arm viewport; key_visibility Arm 3 5 1.0; frame 4; "
    "enabled Arm; clear_animation Arm; update",
    "keys while Sinew is on": "clear_animation Rig; add Arm; key_visibility Arm 2 3 0.0; frame 1; "
    "pose Rig lower; update; frame 3",
    "keys while Sinew is off, saved": "add Arm; enabled Arm; key_visibility Arm 3 7 0.0; frame 5; save_copy; "
    "frame 8",
    "keys while Sinew is off, removed": "frame 3; add Sleeve; enabled Sleeve; "
    "key_visibility Sleeve Armature 2 8 0.0; remove Sleeve; update; frame 9",
    "a driver of one that was off in the viewport": "toggle_modifier Arm Armature 0.9; add Arm dq; "
    "drive_visibility Arm Rig Armature; frame 6; method Arm dq; frame 8; remove Arm",
    "keys of one that was off in the viewport": "toggle_modifier Arm Armature 0.9; add Arm dq; "
    "key_visibility Arm Armature 2 7 0.0; frame 4; method Arm dq; frame 9; remove Arm",
    "a keyed modifier renamed while it is off": "key_visibility Arm 3 9 0.0; add Arm; rename_modifier Arm; "
    "frame 11; frame 6",
    "a driver while Sinew is on": "add Arm dq; frame 8; drive_visibility Arm Rig Armature; frame 6",
    "added while keys hide the first": "add_modifier Arm ARMATURE Rig 0.9; "
    "key_visibility Arm Armature 2 10 0.0; frame 3; add Arm; frame 10; frame 11; frame 4",
    "a render of a hidden mesh": "add Arm dq; key_method Arm 5 11 dq; hide Arm viewport; weights Arm lower; "
    "frame 9; render 0.9",
    # Modifiers
    "the modifier that is on deleted": "add_modifier Arm ARMATURE Rig 0.9; toggle_modifier Arm 'Armature 1'; "
    "add Arm dq; delete_modifier Arm Armature 0.1 0.1; frame 6; frame 11",
    "a deleted Armature modifier": "add Arm 0.3 0.3; frame 6; delete_modifier Arm 0.1; "
    "says Arm 'Armature modifier was deleted'; frame 3; touch Arm; frame 4; "
    "says Arm 'Armature modifier was deleted'; remove_all",
    "one of two deleted": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; frame 6; "
    "delete_modifier Arm Armature 0.1 0.1; frame 11",
    "the other of two deleted": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; frame 6; "
    "delete_modifier Arm 'Armature 1' 0.1 0.1; frame 11",
    "a third added": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; frame 6; "
    "add_modifier Arm ARMATURE Rig 0.9 0.9; frame 11; remove Arm; frame 6",
    "a second one where the first is off in the viewport": "toggle_modifier Arm Armature 0.9; add Arm dq; "
    "add_modifier Arm Rig ARMATURE; frame 9; remove Arm",
    "chained ones swapped": "add_modifier Arm ARMATURE 'Other Rig' 0.9 0.1; add Arm; frame 6; "
    "move_modifier Arm Armature 'Armature 1'; frame 11; move_modifier Arm Armature 'Armature 1'; frame 6; "
    "remove Arm",
    "chained ones swapped while it is hidden": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add Arm; "
    "hide Arm viewport; move_modifier Arm 'Armature 1' Armature; character_method 'Other Rig' dq; "
    "hide Arm viewport; frame 8",
    "something moved between": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add_modifier Arm SUBSURF 0.9; "
    "add Arm; frame 6; move_modifier Arm 'Subsurf 2' 'Armature 1'; frame 11; "
    "move_modifier Arm 'Subsurf 2' Armature; frame 6; remove Arm",
    "a second one moved away": "add_modifier Arm ARMATURE 'Other Rig' 0.9; add_modifier Arm CAST 0.9; "
    "add Arm; move_modifier Arm 'Armature 1' 'Cast 2'; frame 11; move_modifier Arm 'Armature 1' 'Cast 2'; "
    "frame 6; remove Arm",
    "chained to one without an armature": "add_modifier Arm ARMATURE 'Other Rig' 0.9; "
    "delete_armature 'Other Rig'; clear_animation Rig; add Arm; frame 6; pose Rig lower; update; frame 11",
    "the same in front": "add_modifier Arm ARMATURE 'Other Rig' 0.9 0.1; delete_armature 'Other Rig'; "
    "clear_animation Rig; add Arm; frame 6; pose Rig lower; update; frame 11",
    "in front and back, keyed": "add_modifier Arm SOLIDIFY 0.9; key_visibility Arm 1 6 1.0; add Arm dq; "
    "move_modifier Arm 'Solidify 1' Armature; update; move_modifier Arm 'Solidify 1' Armature; frame 11",
    "a multi modifier chained while off": "armature_options Arm multi; add Arm; enabled Arm; "
    "add_modifier Arm ARMATURE 'Other Rig'; frame 6; enabled Arm; frame 11",
    "moved and renamed before a frame": "add_modifier Arm ARMATURE 'Other Rig' 0.9; "
    "add_modifier Arm CAST 0.9; add Arm; frame 4; ~move_modifier Arm 'Cast 2' Armature; "
    "~rename_modifier Arm Armature; frame 6; frame 11",
    "one that needs the mesh itself meanwhile": "add Arm dq; frame 6; needs_original_mesh Arm MULTIRES; "
    "frame 8; needs_original_mesh Arm SOFT_BODY; frame 9",
    # In front of the Armature modifier
    "shape keys before one in front": "add_shape_key Arm; key_shape_key Arm 1 11; add_modifier Arm SUBSURF; "
    "add Arm; frame 6; method Arm dq; frame 11",
    "an animated one": "add_modifier Arm CAST; key_modifier Arm 1 11; add Arm; frame 6; frame 11; "
    "render 0.9",
    "weights that change": "add_modifier Arm VERTEX_WEIGHT_EDIT lower; add Arm; frame 6; weights Arm lower; "
    "frame 11",
    "weights that change, after a render by the Armature modifier": "add Arm dq; frame 11; "
    "add_modifier Arm VERTEX_WEIGHT_EDIT lower; icons Arm 2 Sinew render Armature render; frame 5",
    "its vertex groups change": "add_modifier Arm SUBSURF; add Arm 0.9 log; frame 6; rename_bone Rig lower; "
    "frame 8; groups Arm rename upper; frame 9; groups Arm bone 'group 3' upper; groups Arm move; frame 4",
    "nodes": "add_modifier Arm NODES; add Arm; frame 6; move_vertices Arm; frame 11; remove_all",
    "absolute shape keys": "add_shape_key Arm; absolute_shape_keys Arm; add Arm; frame 6; "
    "absolute_shape_keys Arm; frame 11",
    "a parent that deforms": "parent Arm Rig ARMATURE; frame 6; parent Arm none; add Arm; "
    "parent Arm Rig ARMATURE; frame 11; enabled Arm; frame 6; enabled Arm; remove Arm",
    "its mesh changes": "add_shape_key Arm; key_shape_key Arm 1 11; add_modifier Arm SOLIDIFY; add Arm; "
    "frame 6; move_vertices Arm; shape_key_points Arm; weights Arm lower; shape_key_value Arm 0.7 0.9; "
    "shape_key_value Arm 0.7 0.1; edit_mesh Arm delete 0.3; frame 11",
    "another mesh with shape keys": "add_shape_key Arm; add_modifier Arm SUBSURF; add Arm; frame 6; "
    "replace_mesh Arm; shape_key_value Arm 0.9 0.9; swap_mesh Arm; shape_key_value Arm 0.9 0.9; frame 8",
    "a shared mesh in the place of which it gets its own": "add_modifier Leg SUBSURF; share_mesh Leg Box; "
    "add Leg dq; swap_mesh Leg; ~move_vertices Box; render 0.1; frame 9; move_vertices Box; frame 6",
    "a keyed shape key deleted": "add_shape_key Arm; key_shape_key Arm 1 11; add_shape_key Arm; "
    "add_modifier Arm SUBSURF; add Arm; frame 6; delete_shape_key Arm 0.9 'key 1'; frame 7",
    "its mesh without shape keys changes": "add_modifier Arm MASK lower; add Arm; frame 6; "
    "weights Arm lower; move_vertices Arm; frame 9; edit_mesh Arm delete 0.3; frame 11",
    "it comes, changes and goes": "add Arm; add_modifier Arm SUBSURF; frame 7; "
    "toggle_modifier Arm 'Subsurf 1'; add_modifier Arm CAST; frame 6; delete_modifier Arm 'Cast 2' 0.9; "
    "toggle_modifier Arm 'Subsurf 1'; frame 7; toggle_modifier Arm 'Subsurf 1'; frame 6; remove_all",
    "edit mode and one update": "add_modifier Arm SUBSURF; add Arm; frame 8; edit_mesh Arm nothing 0.9; "
    "leave_mode",
    "sculpt mode and one update": "add_modifier Arm SUBSURF; add Arm; frame 8; sculpt_mode Arm 0.9; "
    "leave_mode",
    "added to another": "add_modifier Arm CAST; add Arm; frame 8; add_modifier Arm SUBSURF; frame 9; "
    "remove_all",
    "others while one waits": "add Arm; add Leg; hide Leg viewport; frame 8; ~add_modifier Arm SUBSURF; "
    "~hide Leg viewport; frame 9",
    "Sinew added while it is hidden": "add_modifier Arm DECIMATE; hide Arm viewport; frame 8; add Arm; "
    "update; hide Arm viewport",
    "a copy with points of its own": "add_modifier Arm SUBSURF; add Arm; duplicate Arm; frame 8; "
    "remove Arm; frame 4; enabled 'object 2'",
    "an Armature modifier in front of it": "add Arm; add_modifier Arm SMOOTH; "
    "add_modifier Arm ARMATURE 'Other Rig'; frame 6; frame 11",
    "a scene that redo brings back": "frame 8; +add Arm; +copy_scene; undo; redo; update",
    "a view layer that first shows it": "add_modifier Sleeve SUBSURF; add Sleeve; view_layer; view_layer; "
    "hide_collection Props exclude; frame 9; save_and_load; view_layer; frame 6",
    "applied": "add_modifier Arm CAST; move_object Arm 0.3 0.1; add Arm; frame 8; apply_modifier Arm; "
    "update",
    "an applied transform": "add_modifier Arm CAST; move_object Arm 0.3 0.1; add Arm; frame 8; "
    "apply_transform Arm; remove Arm",
    # Normals that Sinew gives
    "edges marked between frames": "shade Arm smooth; add Arm dq; frame 6; shade Arm edges; frame 8; "
    "shade Arm faces; frame 9; shade Arm custom; frame 4; shade Arm flat; frame 6; shade Arm smooth; frame 8",
    "normals of a shared mesh": "shade Arm custom; duplicate Arm; add Arm dq; add 'object 1' dq; frame 6; "
    "frame 9; delete_object 'object 1'; frame 4",
    "normals, scaled": "shade Arm custom; add_shape_key Arm; key_shape_key Arm 1 11; add Arm dq; "
    "move_object Arm 0.1 0.1; frame 6; frame 9",
    "a modifier behind by a handler": "shade Arm smooth; add Arm dq; frame 4; "
    "neighbour Arm frame_change_post add 5; update; frame 6; neighbour Arm depsgraph_update_post add 7; "
    "frame 8",
    # Stages, where the rest shape moves
    "a limit on a mesh that moves": "key_object Arm 2 9; add Arm dq; stages Arm 3; frame 3; frame 9; frame 6",
    "a limit on a shape key": "add_shape_key Arm; key_shape_key Arm 1 11; add Arm dq; stages Arm 3; frame 3; "
    "frame 9",
    "smoothed where it is edited": "add Arm; stages Arm 6; frame 9; weights Arm lower; move_vertices Arm; "
    "edit_mesh Arm delete; frame 6; save_and_load; duplicate Arm 0.9; frame 8; remove 'object 1'; remove_all",
    "mixed where it is painted": "add Arm; stages Arm 1; frame 9; weights Arm lower; "
    "groups Arm rename lower; frame 6; save_and_load; stages Arm 0.9; frame 8",
    # Renamed, removed, undone
    "envelopes of a moving shape key": "armature_options Arm envelopes; add_shape_key Arm; "
    "key_shape_key Arm 1 11; add Arm; frame 6; frame 11",
    "a modifier renamed": "add Arm dq; rename_modifier Arm; frame 6; remove Arm; frame 11",
    "renamed by a handler": "add Arm dq; neighbour Arm frame_change_pre name 6; frame 9; frame 3",
    "modifiers renamed by a handler": "add_modifier Arm CAST; add Arm dq; "
    "neighbour Arm frame_change_pre rename 6; frame 9; neighbour Arm frame_change_post rename 4; frame 3",
    "keys of the method removed": "key_object Arm 2 9; add Arm dq; key_method Arm 1 8 lbs dq; frame 5; "
    "remove Arm; frame 9; remove_all",
    "Sinew's modifier deleted and undone": "+add Arm dq; +frame 6; +delete_sinew_modifier Arm; frame 9; "
    "undo; frame 4; redo; frame 11",
    "Sinew's modifier deleted, undone to what it leaves": "~add Arm; ~delete_sinew_modifier Arm; "
    "+~move_vertices Leg; +~weights Leg thigh; ~frame 10; ~undo; remove_all",
    "its driver taken away after an undo": "+~add Arm; +~frame 6; ~remove Arm; ~undo; "
    "~delete_points Arm driver; move_vertices Arm",
    "bendy bones of a scene that is copied": "add_modifier Arm NODES; bone_options Rig hand segments 3; "
    "add Arm; copy_scene 0.2; frame 6",
    "applied and undone": "+add Arm dq; +frame 6; +apply_modifier Arm; frame 11; undo; frame 4; redo; "
    "frame 9",
    "drivers of what was applied": "drive_visibility Leg 'Other Rig' Armature; add Leg; apply_modifier Leg; "
    "copy_modifiers Sleeve Leg; frame 5",
    "applied at rest": "add Arm dq; apply_modifier Arm; frame 11; remove_all",
    "converted and undone": "+add Arm dq; +frame 6; +convert_to_mesh Arm; frame 11; undo; frame 4",
    "an armature deleted and undone": "+add Arm; +add Leg; +frame 6; +delete_armature Rig; frame 11; undo; "
    "frame 4",
    # In an opened file, whose first undo step has the modifiers that Sinew replaces; also while it is hidden
    **{
        f"undone: {edit}": "add_shape_key Arm; add Arm dq; frame 8; save_and_load; +frame 6; "
        f"+{edit}; undo; redo; undo; frame 4; +{edit}; +hide Arm viewport; undo; undo; frame 9; remove_all"
        for edit in (
            *("weights Arm lower", "move_vertices Arm", "edit_mesh Arm move", "edit_mesh Arm delete"),
            *("swap_mesh Arm", "shape_key_points Arm", "shape_key_value Arm 0.9 0.9", "pose Rig lower"),
            *("edit_bones Rig roll lower", "edit_bones Rig move lower", "rename_bone Rig lower"),
            *("bone_options Rig deform lower", "groups Arm rename lower", "groups Arm move"),
            *("armature_options Arm mask lower", "add_modifier Arm CAST", "add_modifier Arm CAST 0.9"),
            *("another_armature Arm 'Other Rig'", "method Arm lbs", "remove Arm"),
        )
    },
    "deleted and undone": "add Arm dq; frame 8; save_and_load; +frame 6; +delete_object Arm; undo; redo; "
    "undo; frame 4; remove_all",
}  # fmt: skip


@pytest.fixture(scope="module")
def pairs():
    found = {route: walk.Pair(route) for route in walk.ROUTES}
    yield found
    for pair in found.values():
        pair.close()


# Where the two routes read something at another time.
ON_BOTH_ROUTES = (
    *("a bone made while Sinew is off", "undo in edit mode of a shared armature", "others while one waits"),
    *("deleted keys where the modifier is on", "keys while Sinew is on", "without size, in a parent"),
    *("weights after a method", "vertices after off and on", "weights after a heat map"),
    *("a scene that redo brings back", "a view layer that first shows it", "applied"),
    "normalised while it is painted",
)
WAYS = (("evaluation", False), ("evaluation", True), ("update", False))
# In the first tier, the newest Blender runs all of them by one way, each other one every second of them.
NAMES = list(CASES) if IS_NEWEST else list(CASES)[bpy.app.version[1] % 2 :: 2]
QUICK = {(name, *WAYS[0]) for name in NAMES} | {(name, *WAYS[-1]) for name in ON_BOTH_ROUTES}
EVERY = [(name, *way) for way in WAYS for name in CASES]


@pytest.mark.parametrize(
    ("name", "route", "is_left"),
    [pytest.param(*each, marks=() if each in QUICK else pytest.mark.slow) for each in EVERY],
)
def test_both_blenders_are_alike(pairs, name, route, is_left):
    outcome = walk.walk(pairs[route], 0, walk_script.steps_of(CASES[name], is_left))
    assert outcome.fault is None, f"{outcome.fault.kind}: {outcome.fault.text}\n" + "\n".join(outcome.said)
