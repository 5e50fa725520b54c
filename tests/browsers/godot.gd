# SPDX-License-Identifier: GPL-3.0-or-later
# Godot plays a glTF file, and writes the points and normals of each mesh as its shader has them.
# Arguments: the file (res://: as the editor has imported it), a time in seconds, a folder for what is written; a method
# for meshes without the extension.
extends SceneTree

const WIDTH := 256
# Each vertex is a point on a pixel of its own, the colours of which have four bits each of the bits of a number.
# `first` is also the name of an argument in sinew.glsl.
const READ := """
shader_type spatial;
render_mode unshaded;
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
	var first := 0
	var instances := scene.find_children("*", "MeshInstance3D")
	for instance: MeshInstance3D in instances:
		var arrays := instance.mesh.surface_get_arrays(0)
		var format: int = instance.mesh.surface_get_format(0) & ~(Mesh.ARRAY_FORMAT_CUSTOM0 - 1)
		var own := {"first": first, "count": arrays[Mesh.ARRAY_VERTEX].size()}
		for number in [Mesh.ARRAY_VERTEX, Mesh.ARRAY_BONES, Mesh.ARRAY_WEIGHTS]:
			var file := FileAccess.open("%s/%s.%d" % [arguments[2], instance.name, number], FileAccess.WRITE)
			file.store_buffer(arrays[number].to_byte_array())
		var points := ArrayMesh.new()
		arrays[Mesh.ARRAY_INDEX] = null
		points.add_surface_from_arrays(Mesh.PRIMITIVE_POINTS, arrays, [], {}, format)
		var material := ShaderMaterial.new()
		material.shader = shader
		material.set_shader_parameter("first", first)
		points.surface_set_material(0, material)
		instance.mesh = points
		instance.extra_cull_margin = 1000.0
		first += own["count"]
		about[instance.name] = own
		if arguments.size() > 3:
			var sinew: Node = load("res://addons/sinew/sinew.gd").new()
			sinew.method = arguments[3]
			instance.add_child(sinew)
	RenderingServer.set_default_clear_color(Color.BLACK)
	root.add_child(scene)
	root.add_child(Camera3D.new())
	var player: AnimationPlayer = scene.find_children("*", "AnimationPlayer")[0]
	player.play(player.get_animation_list()[0])
	player.seek(float(arguments[1]), true)
	player.pause()
	for part in 21:
		for instance: MeshInstance3D in instances:
			instance.get_active_material(0).set_shader_parameter("part", part)
		for frame in 2:
			await RenderingServer.frame_post_draw
		var image := root.get_texture().get_image()
		image.convert(Image.FORMAT_RGB8)
		FileAccess.open("%s/%d" % [arguments[2], part], FileAccess.WRITE).store_buffer(image.get_data())
	for instance: MeshInstance3D in instances:
		about[instance.name]["box"] = [instance.custom_aabb.position, instance.custom_aabb.end].map(_list)
	FileAccess.open(arguments[2] + "/about.json", FileAccess.WRITE).store_string(JSON.stringify(about))
	quit()


func _list(vector: Vector3) -> Array:
	return [vector.x, vector.y, vector.z]


func _loaded(path: String) -> Node:
	if path.begins_with("res://"):
		return load(path).instantiate()
	var document := GLTFDocument.new()
	var state := GLTFState.new()
	GLTFDocument.register_gltf_document_extension(load("res://addons/sinew/reader.gd").new())
	document.append_from_file(path, state)
	return document.generate_scene(state)
