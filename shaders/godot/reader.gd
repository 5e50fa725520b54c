# SPDX-License-Identifier: MIT
## Gives each mesh of a glTF file that has the extension SINEW_skinning a node of sinew.gd.
@tool
extends GLTFDocumentExtension

const Sinew := preload("sinew.gd")
const NAME := "SINEW_skinning"
const FLOAT := 5126


func _get_supported_extensions() -> PackedStringArray:
	return [NAME]


# Godot merges and sorts vertices, and leaves out the attributes of others: each vertex gets its number in a pair of
# texture coordinates that the file does not use.
func _import_preflight(state: GLTFState, extensions: PackedStringArray) -> Error:
	if NAME not in extensions:
		return ERR_SKIP
	var json := state.json
	var numbers := PackedFloat32Array()
	for mesh: Dictionary in json["meshes"]:
		for primitive: Dictionary in mesh["primitives"] if _extension(mesh) else []:
			var attributes: Dictionary = primitive["attributes"]
			var custom := 0
			while "TEXCOORD_%d" % (2 + 2 * custom) in attributes:
				custom += 1
			if custom > 2:
				push_error("%s: no texture coordinates are left for SINEW_skinning" % state.filename)
				return ERR_UNAVAILABLE
			var count := int(json["accessors"][int(attributes["POSITION"])]["count"])
			for number in range(numbers.size() / 2, count):
				numbers.append_array([number, 0.0])
			primitive[NAME] = custom
			attributes["TEXCOORD_%d" % (2 + 2 * custom)] = json["accessors"].size()
			var accessor := {"componentType": FLOAT, "count": count, "type": "VEC2"}
			json["accessors"].append(accessor.merged({"bufferView": json["bufferViews"].size()}))
	var bytes := numbers.to_byte_array()
	var uri := "data:application/octet-stream;base64," + Marshalls.raw_to_base64(bytes)
	json["bufferViews"].append({"buffer": json["buffers"].size(), "byteLength": bytes.size()})
	json["buffers"].append({"byteLength": bytes.size(), "uri": uri})
	return OK


func _import_node(state: GLTFState, gltf_node: GLTFNode, _json: Dictionary, node: Node) -> Error:
	if gltf_node.mesh < 0 or gltf_node.skin < 0:
		return OK
	var mesh: Dictionary = state.json["meshes"][gltf_node.mesh]
	if not _extension(mesh):
		return OK
	var made := Sinew.new()
	made.name = "Sinew"
	made.content = _extension(mesh)
	made.skin_content = _extension(state.json["skins"][gltf_node.skin])
	for surface in mesh["primitives"].size():
		var primitive: Dictionary = mesh["primitives"][surface]
		var arrays := state.meshes[gltf_node.mesh].mesh.get_surface_arrays(surface)
		var own := {}
		for attribute: String in primitive["attributes"]:
			if attribute.begins_with("_SINEW_"):
				own[attribute] = _floats(state, primitive["attributes"][attribute])
		made.customs.append(primitive[NAME])
		made.vertices.append(made.image_of_vertices(arrays, arrays[Mesh.ARRAY_CUSTOM0 + primitive[NAME]], own))
	node.add_child(made)
	made.owner = node.owner
	return OK


func _extension(of: Dictionary) -> Dictionary:
	return of.get("extensions", {}).get(NAME, {})


func _floats(state: GLTFState, number: int) -> PackedFloat32Array:
	var accessor := state.accessors[number]
	var view := state.buffer_views[accessor.buffer_view]
	var width := 3 if accessor.accessor_type == GLTFAccessor.TYPE_VEC3 else 1
	var stride := view.byte_stride if view.byte_stride > 0 else 4 * width
	var bytes := view.load_buffer_view_data(state)
	var found := PackedFloat32Array()
	for k in accessor.count * width:
		found.append(bytes.decode_float(accessor.byte_offset + k / width * stride + 4 * (k % width)))
	return found
