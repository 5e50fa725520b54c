# SPDX-License-Identifier: MIT
## Deforms the MeshInstance3D above it as the extension SINEW_skinning of its glTF file says, else by [member method].
## sinew.glsl is to be beside this file, by the name sinew.gdshaderinc; docs/engines.md has the rest.
class_name SinewSkinning extends Node

const METHODS := {"lbs": 0, "dq": 1, "cor": 2}
const HIERARCHY := 4
const FUNCTIONS: ShaderInclude = preload("sinew.gdshaderinc")
# Vertices in a row of their texture.
const ROW := 1024

# Of a vertex, texels have: its centre and its share of the second method; its
# amounts of the stages; then joints and weights of four influences, and of four more.
const SKIN := """
#define SINEW_BONES_DECLARED
#define SINEW_BONE(bone, k) texelFetch(sinew_bones, ivec2(k, bone), 0)
#define SINEW_INFLUENCES {influences}
uniform sampler2D sinew_bones : filter_nearest;
uniform sampler2D sinew_vertices : filter_nearest;
uniform int sinew_first;
uniform int sinew_second;
uniform int sinew_form;
{functions}
vec3 sinew_direction(vec3 direction, float twist, vec3 rest, int joints[SINEW_INFLUENCES],
		float weights[SINEW_INFLUENCES]) {
	return sinew_twist_normal(sinew_normal(sinew_first, direction, joints, weights), twist, rest, joints, weights);
}
void sinew(int number, inout vec3 vertex, inout vec3 normal, inout vec3 tangent, inout vec3 binormal) {
	ivec2 at = ivec2(number % {row} * {texels}, number / {row});
	vec4 centre = texelFetch(sinew_vertices, at, 0);
	vec4 amounts = texelFetch(sinew_vertices, at + ivec2(1, 0), 0);
	int joints[SINEW_INFLUENCES] = int[]({joints});
	float weights[SINEW_INFLUENCES] = float[]({weights});
	vec3 rest = vertex;
	vertex = sinew_mix(sinew_first, sinew_second, centre.w, rest, centre.xyz, joints, weights);
	float linear_share = sinew_linear_share(sinew_first, sinew_second, centre.w);
	vertex = sinew_twist_spread(vertex, linear_share, amounts.x, rest, joints, weights);
	vertex = sinew_bulge_limit(vertex, sinew_form, amounts.y, rest, joints, weights);
	normal = sinew_direction(normal, amounts.x, rest, joints, weights);
	tangent = sinew_direction(tangent, amounts.x, rest, joints, weights);
	binormal = sinew_direction(binormal, amounts.x, rest, joints, weights);
}
"""

# What glTF has of a material, by the names that StandardMaterial3D gives its parameters.
const STANDARD := """
shader_type spatial;
render_mode {modes};
uniform vec4 albedo : source_color;
uniform sampler2D texture_albedo : source_color, {sampling};
uniform float alpha_scissor_threshold;
uniform float metallic;
uniform float specular;
uniform sampler2D texture_metallic : hint_default_white, {sampling};
uniform float roughness;
uniform sampler2D texture_roughness : hint_default_white, {sampling};
uniform sampler2D texture_normal : hint_normal, {sampling};
uniform float normal_scale;
uniform sampler2D texture_ambient_occlusion : hint_default_white, {sampling};
uniform float ao_light_affect;
uniform sampler2D texture_emission : source_color, {emission_default}, {sampling};
uniform vec4 emission : source_color;
uniform float emission_energy;
uniform vec3 uv1_scale;
uniform vec3 uv1_offset;
void vertex() {
	UV = UV * uv1_scale.xy + uv1_offset.xy;
}
void fragment() {
	vec4 colour = albedo * texture(texture_albedo, UV){colour};
	ALBEDO = colour.rgb;
	METALLIC = metallic * texture(texture_metallic, UV).{metallic};
	ROUGHNESS = roughness * texture(texture_roughness, UV).{roughness};
	SPECULAR = specular;
	{features}
}
"""
const CHANNELS := "rgbar"

@export_enum("lbs", "dq") var method := "dq"
## Of the glTF file: the extension of the mesh, and that of the skin.
@export_storage var content := {}
@export_storage var skin_content := {}
## Of each surface: its vertices, and the array, CUSTOM0 to CUSTOM2, that has their numbers.
@export_storage var vertices: Array[Image] = []
@export_storage var customs: PackedInt32Array = []

# By their text: all meshes that have the same share one.
static var _shaders: Dictionary[String, Shader] = {}

var _instance: MeshInstance3D
var _skeleton: Skeleton3D
# Of each bind of the skin: its bone, its axes at rest, and the box of its vertices.
var _bones: PackedInt32Array = []
var _rest: Array[Transform3D] = []
var _boxes: Array[AABB] = []
var _values: PackedFloat32Array = []
var _texture: ImageTexture


func _ready() -> void:
	_instance = get_parent()
	_skeleton = _instance.get_node(_instance.skeleton)
	content = {"method": method}.merged(content, true)
	content = {"mix": content["method"], "parameters": {}, "stages": []}.merged(content, true)
	if not METHODS.has_all([content["method"], content["mix"]]):
		push_warning("%s: skinned linearly, as sinew.glsl lacks %s" % [_instance.name, content])
		return
	for bind in _instance.skin.get_bind_count():
		var bone := _instance.skin.get_bind_bone(bind)
		_bones.append(bone if bone >= 0 else _skeleton.find_bone(_instance.skin.get_bind_name(bind)))
		_rest.append(_instance.skin.get_bind_pose(bind).affine_inverse())
		_boxes.append(AABB())
	_values.resize(32 * _bones.size())
	_texture = ImageTexture.create_from_image(_image_of_bones())
	for surface in _instance.mesh.get_surface_count():
		_skin(surface)
	# Else Godot skins first.
	_instance.skeleton = NodePath()
	_skeleton.skeleton_updated.connect(_update)
	_update()


# --- Vertices

## of: arrays of a surface. numbers: pairs, the number of each vertex first; empty: they are in order. own: the
## attributes of the extension, by number
func image_of_vertices(of: Array, numbers: PackedFloat32Array, own: Dictionary) -> Image:
	var bones: PackedInt32Array = of[Mesh.ARRAY_BONES]
	var weights: PackedFloat32Array = of[Mesh.ARRAY_WEIGHTS]
	var count: int = of[Mesh.ARRAY_VERTEX].size()
	var influences := bones.size() / count
	var texels := 2 + influences / 2
	var last := count - 1
	for k in range(0, numbers.size(), 2):
		last = maxi(last, int(numbers[k]))
	var values := PackedFloat32Array()
	values.resize(4 * texels * ROW * (last / ROW + 1))
	var stages: Array = content.get("stages", [])
	var strength: float = content.get("parameters", {}).get("bulge_limit.strength", 1.0)
	for k in count:
		var number := int(numbers[2 * k]) if numbers else k
		var start := 4 * texels * number
		if "_SINEW_CENTRE" in own:
			for axis in 3:
				values[start + axis] = own["_SINEW_CENTRE"][3 * number + axis]
		values[start + 3] = _amount(own, "_SINEW_MIX", number, "mix" in content)
		values[start + 4] = _amount(own, "_SINEW_TWIST_SPREAD", number, "twist_spread" in stages)
		values[start + 5] = strength * _amount(own, "_SINEW_BULGE_LIMIT", number, "bulge_limit" in stages)
		for i in influences:
			values[start + 8 + i / 4 * 8 + i % 4] = bones[influences * k + i]
			values[start + 12 + i / 4 * 8 + i % 4] = weights[influences * k + i]
	return Image.create_from_data(texels * ROW, last / ROW + 1, false, Image.FORMAT_RGBAF, values.to_byte_array())


func _amount(own: Dictionary, attribute: String, number: int, is_on: bool) -> float:
	return (own[attribute][number] if attribute in own else 1.0) if is_on else 0.0


# --- Materials

func _skin(surface: int) -> void:
	var mesh: ArrayMesh = _instance.mesh
	if vertices.size() <= surface:
		vertices.append(image_of_vertices(mesh.surface_get_arrays(surface), [], {}))
	var boxes: Array = RenderingServer.mesh_get_surface(mesh.get_rid(), surface).get("bone_aabbs", [])
	for bind in mini(boxes.size(), _boxes.size()):
		if boxes[bind].size.x >= 0.0:
			_boxes[bind] = _boxes[bind].merge(boxes[bind]) if _boxes[bind].size else boxes[bind]
	var joints: PackedStringArray = []
	var weights: PackedStringArray = []
	for i in 8 if mesh.surface_get_format(surface) & Mesh.ARRAY_FLAG_USE_8_BONE_WEIGHTS else 4:
		var texel := "texelFetch(sinew_vertices, at + ivec2(%d, 0), 0)." + "xyzw"[i % 4]
		joints.append("int(%s)" % texel % (2 + i / 4 * 2))
		weights.append(texel % (3 + i / 4 * 2))
	var values := {"influences": joints.size(), "texels": 2 + joints.size() / 2, "row": ROW}
	values.merge({"joints": ", ".join(joints), "weights": ", ".join(weights), "functions": FUNCTIONS.code})
	var number := "int(CUSTOM%d.x)" % customs[surface] if surface < customs.size() else "VERTEX_ID"
	var call := "\n\tsinew(%s, VERTEX, NORMAL, TANGENT, BINORMAL);" % number
	var parameters := {"sinew_bones": _texture, "sinew_first": _number("method"), "sinew_second": _number("mix")}
	parameters["sinew_vertices"] = ImageTexture.create_from_image(vertices[surface])
	parameters["sinew_form"] = int(content["parameters"].get("bulge_limit.form") == "kim_han")
	var made := _skinned(_instance.get_active_material(surface), SKIN.format(values), call, parameters)
	_instance.set_surface_override_material(surface, made)


func _number(entry: String) -> int:
	var signs: Variant = content["parameters"].get(content[entry] + ".signs")
	return METHODS[content[entry]] + (HIERARCHY if signs == "hierarchy" else 0)


# A copy of a material, and of those behind it, that skins.
func _skinned(material: Material, functions: String, call: String, parameters: Dictionary) -> ShaderMaterial:
	var made: ShaderMaterial = material.duplicate() if material is ShaderMaterial else _converted(material)
	# Godot takes an argument by the name of a uniform for that, and refuses one by the name of what is global before it.
	for uniform in made.shader.get_shader_uniform_list():
		var name_alone := RegEx.create_from_string("(?<![.\\w])%s\\b" % uniform["name"])
		functions = name_alone.sub(functions, "sinew_own_" + uniform["name"], true)
	var code := RegEx.create_from_string("shader_type\\s+spatial\\s*;").sub(made.shader.code, "$0" + functions)
	var vertex := RegEx.create_from_string("\\bvoid\\s+vertex\\s*\\(\\s*\\)\\s*\\{").search(code)
	code = code.insert(vertex.get_end(), call) if vertex else code + "void vertex() {%s\n}\n" % call
	if code not in _shaders:
		_shaders[code] = Shader.new()
		_shaders[code].code = code
	made.shader = _shaders[code]
	for name: String in parameters:
		made.set_shader_parameter(name, parameters[name])
	if material and material.next_pass:
		made.next_pass = _skinned(material.next_pass, functions, call, parameters)
	return made


func _converted(material: StandardMaterial3D) -> ShaderMaterial:
	material = material if material else StandardMaterial3D.new()
	var modes := ["cull_" + ["back", "front", "disabled"][material.cull_mode]]
	modes.append("blend_" + ["mix", "add", "sub", "mul", "premul_alpha"][material.blend_mode])
	modes.append_array(["unshaded"] if material.shading_mode == BaseMaterial3D.SHADING_MODE_UNSHADED else [])
	var lines: PackedStringArray = []
	match material.transparency:
		BaseMaterial3D.TRANSPARENCY_ALPHA_SCISSOR:
			lines = ["ALPHA = colour.a;", "ALPHA_SCISSOR_THRESHOLD = alpha_scissor_threshold;"]
		BaseMaterial3D.TRANSPARENCY_ALPHA_HASH:
			lines = ["ALPHA = colour.a;", "ALPHA_HASH_SCALE = 1.0;"]
		BaseMaterial3D.TRANSPARENCY_ALPHA, BaseMaterial3D.TRANSPARENCY_ALPHA_DEPTH_PRE_PASS:
			lines = ["ALPHA = colour.a;"]
	if material.transparency == BaseMaterial3D.TRANSPARENCY_ALPHA_DEPTH_PRE_PASS:
		modes.append("depth_prepass_alpha")
	if material.normal_enabled:
		lines += PackedStringArray(["NORMAL_MAP = texture(texture_normal, UV).rgb;", "NORMAL_MAP_DEPTH = normal_scale;"])
	if material.ao_enabled:
		lines.append("AO = texture(texture_ambient_occlusion, UV)." + CHANNELS[material.ao_texture_channel] + ";")
		lines.append("AO_LIGHT_AFFECT = ao_light_affect;")
	var adds := material.emission_operator == BaseMaterial3D.EMISSION_OP_ADD
	if material.emission_enabled:
		var operator := "+" if adds else "*"
		lines.append("EMISSION = (emission.rgb %s texture(texture_emission, UV).rgb) * emission_energy;" % operator)
	var made := ShaderMaterial.new()
	made.shader = Shader.new()
	made.shader.code = STANDARD.format({
		"modes": ", ".join(modes),
		"features": "\n\t".join(lines),
		"sampling": "filter_linear_mipmap, repeat_%s" % ("enable" if material.texture_repeat else "disable"),
		"emission_default": "hint_default_black" if adds else "hint_default_white",
		"colour": " * COLOR" if material.vertex_color_use_as_albedo else "",
		"metallic": CHANNELS[material.metallic_texture_channel],
		"roughness": CHANNELS[material.roughness_texture_channel],
	})
	for uniform in made.shader.get_shader_uniform_list():
		var value: Variant = RenderingServer.material_get_param(material.get_rid(), uniform["name"])
		made.set_shader_parameter(uniform["name"], value)
	# Keeps its textures.
	made.set_meta("original", material)
	made.render_priority = material.render_priority
	return made


# --- The buffer of bones, as bone_buffer.py makes it

func _update() -> void:
	var motions: Array[Transform3D] = []
	var box := AABB()
	for bind in _bones.size():
		var motion := _skeleton.get_bone_global_pose(_bones[bind]) * _instance.skin.get_bind_pose(bind)
		motions.append(motion)
		for row in 3:
			var at := motion.basis.x[row]
			_write(bind, row, [at, motion.basis.y[row], motion.basis.z[row], motion.origin[row]])
		if _boxes[bind].size:
			box = box.merge(motion * _boxes[bind]) if box.size else motion * _boxes[bind]
	# Bent skin may be outside of the bones' boxes.
	_instance.custom_aabb = box.grow(0.25 * box.get_longest_axis_size())
	var nearby := {-1: Quaternion.IDENTITY}
	for bone in _bones:
		_write_rotation(bone, motions, nearby)
	var lengths: Array = skin_content.get("lengths", [])
	for bind in lengths.size():
		_write_segment(bind, lengths[bind], motions[bind])
	var number := 0
	for twist: Dictionary in skin_content.get("twists", []):
		number += 1
		_write_twist(twist, number, motions)
	_texture.update(_image_of_bones())


func _image_of_bones() -> Image:
	return Image.create_from_data(8, _bones.size(), false, Image.FORMAT_RGBAF, _values.to_byte_array())


func _write(bind: int, vector: int, numbers: Array, start := 0) -> void:
	for k in numbers.size():
		_values[32 * bind + 4 * vector + start + k] = numbers[k]


# Axes of unit length, perpendicular to each other: Y as it is, X as near as it can be.
func _perpendicular(basis: Basis) -> Basis:
	var y := basis.y.normalized()
	var x := (basis.x - y * basis.x.dot(y)).normalized()
	return Basis(x, y, x.cross(y))


func _rotation(from: Basis, to: Basis) -> Quaternion:
	return Quaternion(_perpendicular(to) * _perpendicular(from).transposed())


# Each with the sign that brings it nearest to its parent's; a bone that mirrors counts as its parent.
func _write_rotation(bone: int, motions: Array[Transform3D], nearby: Dictionary) -> Quaternion:
	if bone not in nearby:
		var found := _write_rotation(_skeleton.get_bone_parent(bone), motions, nearby)
		var bind := _bones.find(bone)
		if bind >= 0:
			var q := _rotation(_rest[bind].basis, _skeleton.get_bone_global_pose(bone).basis)
			q = -q if q.dot(found) < 0.0 else q
			_write(bind, 3, [q.x, q.y, q.z, q.w])
			found = q if motions[bind].basis.determinant() >= 0.0 else found
		nearby[bone] = found
	return nearby[bone]


# The direction of a bone's limb at rest: along its Y axis, where the file does not say otherwise.
func _limb(bind: int) -> Vector3:
	var axes: Array = skin_content.get("axes", [])
	var own: Array = axes[bind] if axes else [0.0, 1.0, 0.0]
	return _rest[bind].basis * Vector3(own[0], own[1], own[2])


# From the head to the tail at rest, and how much the motion stretches what is across the limb, at most.
func _write_segment(bind: int, length: float, motion: Transform3D) -> void:
	var head := _rest[bind].origin
	var along := _limb(bind) * length
	var image := motion.basis * along
	var axes := motion.basis
	var stretch := sqrt((axes.x.length_squared() + axes.y.length_squared() + axes.z.length_squared()) / 3.0)
	if length > 0.0:
		var first := Vector3.RIGHT if absf(along.x) < 0.9 * along.length() else Vector3.UP
		first = first.cross(along).normalized()
		var a := motion.basis * first
		var b := motion.basis * along.cross(first).normalized()
		if image:
			a -= a.project(image)
			b -= b.project(image)
		# The larger singular value of the two columns.
		var sum := a.length_squared() + b.length_squared()
		var difference := a.length_squared() - b.length_squared()
		stretch = sqrt(sum / 2.0 + Vector2(difference / 2.0, a.dot(b)).length())
	_write(bind, 4, [head.x, head.y, head.z, stretch, along.x, along.y, along.z, 0.0, 0.0, 0.0, 0.0, 0.0])


func _write_twist(twist: Dictionary, number: int, motions: Array[Transform3D]) -> void:
	# A base without volume: its scale is not known.
	var base := motions[int(twist["base"])].basis
	base = base.inverse() if base.determinant() != 0.0 else Basis.IDENTITY
	var rest := _rest[int(twist["tip"])].basis
	var q := _rotation(rest, base * motions[int(twist["tip"])].basis * rest)
	q = -q if q.w < 0.0 else q
	var along := _limb(int(twist["bone"])).normalized().dot(Vector3(q.x, q.y, q.z))
	var angle := 2.0 * atan2(along, q.w)
	var swing := 2.0 * acos(minf(Vector2(along, q.w).length(), 1.0))
	var spread: float = angle * _fade(angle) * _fade(swing) * twist["amount"]
	spread *= content["parameters"].get("twist_spread.amount", 1.0)
	if spread != 0.0:
		var angles := [-spread, 0.0] if twist["from"] == "parent" else [0.0, spread]
		_write(int(twist["bone"]), 5, [twist["curve"], angles[0], angles[1], number], 3)


# From 1 at 150 degrees to 0 at 180.
func _fade(angle: float) -> float:
	return 1.0 - smoothstep(150.0, 180.0, absf(rad_to_deg(angle)))
