# SPDX-License-Identifier: GPL-3.0-or-later
# Godot plays a glTF file for a second, and writes the points and normals of each mesh as the GPU computes them.
# Arguments: the file (res://: as it was imported), the folder for what is written, and with --linear: without the
# extension, by the method that the node of sinew.gd has on its own.
extends SceneTree

const WIDTH := 256
# Points that are drawn, each on a pixel of its own, have four bits of a number in each colour.
const READ := """
shader_type spatial;
render_mode unshaded, cull_disabled;
uniform int first;
uniform int part;
varying flat vec3 colour;
void vertex() {
	int own = first + VERTEX_ID;
	float values[7] = float[](VERTEX.x, VERTEX.y, VERTEX.z, NORMAL.x, NORMAL.y, NORMAL.z, float(own + 1));
	uint bits = floatBitsToUint(values[part / 3]) >> uint(part % 3 * 12);
	colour = vec3(uvec3(bits, bits >> 4u, bits >> 8u) & uvec3(15u)) / 15.0;
	POSITION = vec4(2.0 * (vec2(ivec2(own % WIDTH, own / WIDTH)) + 0.5) / float(WIDTH) - 1.0, 0.5, 1.0);
	POINT_SIZE = 1.0;
}
void fragment() {
	ALBEDO = colour;
}
"""


func _initialize() -> void:
	var arguments := OS.get_cmdline_user_args()
	var scene := _loaded(arguments[0])
	var shader := Shader.new()
	shader.code = READ.replace("WIDTH", str(WIDTH))
	var about := {}
	var materials: Array[ShaderMaterial] = []
	var first := 0
	for instance: MeshInstance3D in scene.find_children("*", "MeshInstance3D"):
		var numbers := []
		var points := ArrayMesh.new()
		var start := first
		for surface in instance.mesh.get_surface_count():
			var arrays := instance.mesh.surface_get_arrays(surface)
			arrays[Mesh.ARRAY_INDEX] = null
			var flags: int = instance.mesh.surface_get_format(surface) & ~(Mesh.ARRAY_FORMAT_CUSTOM0 - 1)
			points.add_surface_from_arrays(Mesh.PRIMITIVE_POINTS, arrays, [], {}, flags)
			var material := ShaderMaterial.new()
			material.shader = shader
			material.set_shader_parameter("first", first)
			points.surface_set_material(surface, material)
			first += arrays[Mesh.ARRAY_VERTEX].size()
			numbers.append(Array(arrays[Mesh.ARRAY_CUSTOM0] if arrays[Mesh.ARRAY_CUSTOM0] else []))
		instance.mesh = points
		instance.extra_cull_margin = 1000.0
		about[instance.name] = {"first": start, "count": first - start, "numbers": numbers}
	RenderingServer.set_default_clear_color(Color.BLACK)
	root.add_child(scene)
	root.add_child(Camera3D.new())
	var player: AnimationPlayer = scene.find_children("*", "AnimationPlayer")[0]
	player.play(player.get_animation_list()[0])
	player.seek(float(arguments[2]), true)
	player.pause()
	for part in 21:
		for instance: MeshInstance3D in scene.find_children("*", "MeshInstance3D"):
			for surface in instance.mesh.get_surface_count():
				instance.get_active_material(surface).set_shader_parameter("part", part)
		for frame in 2:
			await RenderingServer.frame_post_draw
		var image := root.get_texture().get_image()
		image.convert(Image.FORMAT_RGB8)
		FileAccess.open("%s/%d" % [arguments[1], part], FileAccess.WRITE).store_buffer(image.get_data())
	for instance: MeshInstance3D in scene.find_children("*", "MeshInstance3D"):
		about[instance.name]["box"] = var_to_str(instance.custom_aabb)
	FileAccess.open(arguments[1] + "/about.json", FileAccess.WRITE).store_string(JSON.stringify(about))
	quit()


func _loaded(path: String) -> Node:
	if path.begins_with("res://"):
		return load(path).instantiate()
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	GLTFDocument.register_gltf_document_extension(load("res://addons/sinew/reader.gd").new())
	document.append_from_file(path, state)
	return document.generate_scene(state)
