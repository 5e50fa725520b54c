# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the shaders: they compute what the golden set holds, on a software renderer where there is no
other."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import methods as reader_methods
import numpy as np
import pytest
import skin as reader
import stages as reader_stages
from bone_buffer import add_segments, add_turns, add_twists, bone_buffer, fade, twist_angles
from skinning import Skinning, deformed

REPOSITORY = Path(__file__).resolve().parents[2]
GOLDEN, SHADERS = REPOSITORY / "tests" / "golden", REPOSITORY / "shaders"
METHODS = {"lbs": 0, "dq": 1, "cor": 2, "hierarchy": 4}
FORMS = ["continuous", "kim_han"]
STAGES = ["mix", "twist_spread", "bulge_limit"]
TOLERANCE = 1e-5
MOST = 8
# A turn more than the golden set has: by numpy, which tests/blender/features/pages/test_viewer.py compares
# with Blender.
TURNED = {
    "array": "turned",
    "method": "dq",
    "parameters": {"signs": "blender"},
    "stages": {"twist_spread": {"amount": 0.9, "turns": 1}},
}


class Mesh:
    """A case of the golden set as a shader takes it: in armature space, each vertex with MOST influences."""

    def __init__(self, path):
        self.case, about = reader.read(path)
        self.results = [each for each in about["results"] if is_for_shaders(each)]
        to = self.case["armature_from_mesh"]
        self.points = reader.moved_by(to, self.case["points"])
        self.centres = reader.moved_by(to, self.case["data_cor"])
        self.painted = self.case["painted"]
        self.bones = np.zeros((len(self.points), MOST), np.uint32)
        self.weights = np.zeros((len(self.points), MOST), np.float32)
        for vertex, point in enumerate(self.points):
            of, weights = stored_influences(self.case, vertex, point)
            self.bones[vertex, : len(of)], self.weights[vertex, : len(of)] = of, weights
        self.results.append(TURNED)
        self.case["turned"] = self.turned()
        normals = np.random.default_rng(1).normal(size=self.points.shape)
        self.normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self.tolerance = TOLERANCE * np.linalg.norm(np.ptp(self.case["points"], axis=0))

    def palette(self, result):
        """The buffer of bones; a joint of a bendy bone has the segments beside it."""
        rest, parents = self.case["rest"], self.case["parents"]
        buffer = bone_buffer(self.case["posed"], rest, parents)
        add_segments(buffer, *reader_stages.segments(self.case))
        # The chain's last bone has nothing to share; bendy bones spread their roll themselves.
        twists = [(bone, bone, bone + 1, False) for bone in np.flatnonzero(self.case["segments"][:-1] == 1)]
        motions = self.case["posed"] @ np.linalg.inv(rest)
        angles, swings = twist_angles(motions, rest, twists, rest[:, :3, 1])
        stage = result["stages"].get("twist_spread", {"amount": 0.0})
        around = np.full(len(twists), stage.get("turns", 0))
        angles = stage["amount"] * (angles * fade(np.abs(angles)) * fade(swings) + 2 * np.pi * around)
        add_twists(buffer, twists, angles, [0.0] * len(twists))
        add_turns(buffer, twists, around, np.ones(len(twists)), parents)
        return buffer

    def turned(self):
        counts = self.weights.sum(axis=1, keepdims=True)
        moves = counts > 1e-4
        weights = np.where(moves, self.weights, np.eye(MOST)[0]).astype(np.float64)
        by = Skinning("dq", "dq", twist=np.asarray(self.amounts(TURNED)[1], np.float64))
        bones = self.bones.astype(int), weights, self.palette(TURNED)
        found = np.where(moves, deformed(by, self.points, self.centres, *bones), self.points)
        return reader.moved_by(np.linalg.inv(self.case["armature_from_mesh"]), found)

    def amounts(self, result):
        """Of each vertex: the share of the second method, of Twist Spread, of Limit Bulge."""
        strengths = [result["stages"].get(name, {}).get("strength", 1.0) for name in STAGES]
        return [
            self.painted * strength if name in result["stages"] else 0.0 * self.painted
            for name, strength in zip(STAGES, strengths, strict=True)
        ]

    def expected_normals(self, result):
        """By the rotation of the blend, then by the twists about the posed bones."""
        pose, rest = reader.bones(self.case), self.case["rest"]
        found = self.normals.copy()
        buffer, twist = self.palette(result), self.amounts(result)[1]
        signs = result["parameters"].get("signs", "blender")
        for vertex, point in enumerate(self.points):
            of, weights = reader.influences(self.case, vertex, point)
            if not len(of):
                continue
            q = weights @ reader_methods.signed(of, weights, pose, signs)
            found[vertex] = reader_methods.rotation_of(q) @ found[vertex]
            for bone in sorted(of, key=lambda bone: -buffer[bone, 6, 2]):
                at_head, at_tail, number, _unused = buffer[bone, 6]
                if number:
                    head, along = rest[bone][:3, 3], buffer[bone, 5, :3].astype(np.float64)
                    share = np.clip((point - head) @ along / (along @ along), 0.0, 1.0)
                    axis = pose.motion[bone][:3, :3] @ along
                    axis *= np.sign(np.linalg.det(pose.motion[bone][:3, :3])) / np.linalg.norm(axis)
                    angle = (
                        weights[of == bone].sum() * twist[vertex] * (at_head + share * (at_tail - at_head))
                    )
                    if twist[vertex] * buffer[bone, 6, 3] > 0.5:
                        beyond = weights[of > bone].sum()
                        angle += 4.0 * buffer[bone, 7, 3] * np.arctan2(beyond, 1.0 - beyond) * (beyond < 1.0)
                    found[vertex] = reader_stages.turned(axis, angle, found[vertex])
        return found

    def assert_is(self, result, armature_points):
        points = reader.moved_by(np.linalg.inv(self.case["armature_from_mesh"]), armature_points)
        assert np.abs(points - self.case[result["array"]]).max() <= self.tolerance, result

    def assert_has_normals(self, result, normals):
        # Arctangents in software are less exact.
        tolerance = 4e-5 if result is TURNED else 1e-5
        assert np.abs(normals - self.expected_normals(result)).max() < tolerance, result


def stored_influences(case, vertex, point):
    """As the file has them, of any sum; those of bendy bones over their joints."""
    span = range(case["offsets"][vertex], case["offsets"][vertex + 1])
    pairs = [
        (joint, case["weights"][i] * share)
        for i in span
        for joint, share in reader.joints(case, case["bones"][i], point)
    ]
    return [joint for joint, _weight in pairs], [weight for _joint, weight in pairs]


def is_for_shaders(result):
    return {result["method"], *mixed_methods(result)} <= set(METHODS) and {*result["stages"]} <= {*STAGES}


def numbers(result):
    """The method, the second one, and the form of Limit Bulge."""
    first = METHODS[result["method"]]
    if result["parameters"].get("signs") == "hierarchy":
        first += METHODS["hierarchy"]
    second = [METHODS[name] for name in mixed_methods(result)] or [first]
    return first, *second, FORMS.index(result["stages"].get("bulge_limit", {}).get("form", FORMS[0]))


def glsl(name):
    return (SHADERS / name).read_text().replace('#include "sinew.glsl"', (SHADERS / "sinew.glsl").read_text())


@pytest.fixture(scope="module", params=sorted(GOLDEN.glob("*.npz")), ids=lambda path: path.stem)
def mesh(request):
    return Mesh(request.param)


@pytest.fixture(scope="module")
def context():
    moderngl = pytest.importorskip("moderngl", reason="install moderngl to test the shaders of GLSL")
    try:
        context = moderngl.create_context(
            standalone=True, require=430, **({"backend": "egl"} if sys.platform == "linux" else {})
        )
    except Exception as error:
        pytest.skip(f"no OpenGL 4.3 ({error}): install libegl1 and libgl1-mesa-dri for it")
    yield context
    context.release()


@pytest.fixture
def gl(context):
    # The tests of WGSL may have another context on this thread.
    with context:
        context.simple_framebuffer((1, 1)).use()
        yield context
        assert context.error == "GL_NO_ERROR"


@pytest.fixture(scope="module")
def gpu():
    wgpu = pytest.importorskip("wgpu", reason="install wgpu to test the shaders of WGSL")
    adapters = wgpu.gpu.enumerate_adapters_sync()
    if not adapters:
        pytest.skip("no GPU, not even in software: install libegl1 and libgl1-mesa-dri for one")
    return adapters[0].request_device_sync()


def test_glsl_vertex_shader(gl, mesh):
    assert not mesh.weights[:, 4:].any()
    program = gl.program(glsl("example.vert"), varyings=["skinned_position", "skinned_normal"])
    attributes = {
        "position": (mesh.points, "3f"),
        "normal": (mesh.normals, "3f"),
        "centre": (mesh.centres, "3f"),
        "joints": (mesh.bones[:, :4], "4u"),
        "weights": (mesh.weights[:, :4], "4f"),
    }
    content = [
        (gl.buffer(np.ascontiguousarray(values, np.uint32 if kind == "4u" else np.float32)), kind, name)
        for name, (values, kind) in attributes.items()
    ]
    amounts = gl.buffer(reserve=12 * len(mesh.points))
    vertices = gl.vertex_array(program, [*content, (amounts, "1f 2f", "share", "stages")])
    bones = gl.texture((8, len(mesh.case["rest"])), 4, dtype="f4")
    bones.use(0)
    program["sinew_bones"] = 0
    program["clip_from_armature"].write(np.eye(4, dtype=np.float32).tobytes())
    out = gl.buffer(reserve=24 * len(mesh.points))
    for result in mesh.results:
        program["method"], program["second_method"], program["bulge_form"] = numbers(result)
        amounts.write(np.column_stack(mesh.amounts(result)).astype(np.float32).tobytes())
        bones.write(mesh.palette(result).tobytes())
        vertices.transform(out, mode=gl.POINTS)
        points, normals = np.frombuffer(out.read(), np.float32).reshape(-1, 2, 3).swapaxes(0, 1)
        mesh.assert_is(result, points)
        mesh.assert_has_normals(result, normals)


@pytest.mark.parametrize("influences", [4, MOST])
def test_what_godot_gets_computes_the_same(gl, mesh, influences):
    script = (SHADERS / "godot/sinew.gd").read_text()
    (text,) = re.findall(r'^const SKIN := """(.*?)"""', script, re.MULTILINE | re.DOTALL)
    texels = [
        f"texelFetch(sinew_vertices, at + ivec2({{}}, 0), 0).{'xyzw'[i % 4]}" for i in range(influences)
    ]
    values = {
        "influences": influences,
        "texels": 2 + influences // 2,
        "row": 1024,
        "functions": glsl("sinew.glsl"),
    }
    values["joints"] = ", ".join(f"int({each.format(2 + i // 4 * 2)})" for i, each in enumerate(texels))
    values["weights"] = ", ".join(each.format(3 + i // 4 * 2) for i, each in enumerate(texels))
    for name, value in values.items():
        text = text.replace(f"{{{name}}}", str(value))
    source = f"""#version 330
        {text.replace(" : filter_nearest", "")}
        in vec3 position, at_rest;
        out vec3 point, normal;
        void main() {{
            point = position, normal = at_rest;
            vec3 tangent = normal, binormal = normal;
            sinew(gl_VertexID, point, normal, tangent, binormal);
        }}"""
    program = gl.program(source, varyings=["point", "normal"])
    content = [
        (gl.buffer(values.astype(np.float32).tobytes()), "3f", name)
        for values, name in ((mesh.points, "position"), (mesh.normals, "at_rest"))
    ]
    vertices, count = gl.vertex_array(program, content), len(mesh.points)
    bones = gl.texture((8, len(mesh.case["rest"])), 4, dtype="f4")
    data = gl.texture((1024 * (2 + influences // 2), 1), 4, dtype="f4")
    bones.use(0), data.use(1)
    program["sinew_bones"], program["sinew_vertices"] = 0, 1
    out = gl.buffer(reserve=24 * count)
    for result in mesh.results:
        program["sinew_first"], program["sinew_second"], program["sinew_form"] = numbers(result)
        bones.write(mesh.palette(result).tobytes())
        own = np.zeros((1024, 2 + influences // 2, 4), np.float32)
        own[:count, 0, :3] = mesh.centres
        own[:count, 0, 3], own[:count, 1, 0], own[:count, 1, 1] = mesh.amounts(result)
        for k in range(influences // 4):
            four = slice(4 * k, 4 * k + 4)
            own[:count, 2 + 2 * k], own[:count, 3 + 2 * k] = mesh.bones[:, four], mesh.weights[:, four]
        data.write(own.tobytes())
        vertices.transform(out, mode=gl.POINTS)
        points, normals = np.frombuffer(out.read(), np.float32).reshape(-1, 2, 3).swapaxes(0, 1)
        mesh.assert_is(result, points)
        mesh.assert_has_normals(result, normals)


def packed(mesh, influences, result):
    """float32 words of the struct Vertex of the compute shaders, [vertices, 12 + 2 * influences]."""
    words = np.zeros((len(mesh.points), 12 + 2 * influences), np.float32)
    words[:, :3], words[:, 4:7] = mesh.points, mesh.centres
    words[:, 3], words[:, 7], words[:, 8] = mesh.amounts(result)
    words[:, 12 : 12 + influences] = mesh.bones[:, :influences].view(np.float32)
    words[:, 12 + influences :] = mesh.weights[:, :influences]
    return words


def test_glsl_compute_shader(gl, mesh):
    shader = gl.compute_shader(glsl("example.comp"))
    out = gl.buffer(reserve=16 * len(mesh.points))
    out.bind_to_storage_buffer(2)
    for result in mesh.results:
        gl.buffer(mesh.palette(result)).bind_to_storage_buffer(0)
        gl.buffer(packed(mesh, MOST, result)).bind_to_storage_buffer(1)
        shader["method"], shader["second_method"], shader["bulge_form"] = numbers(result)
        shader.run(group_x=-(-len(mesh.points) // 64))
        mesh.assert_is(result, np.frombuffer(out.read(), np.float32).reshape(-1, 4)[:, :3])


def skinned(gpu, module, mesh, influences):
    """Yields each result of the golden set with the points and normals by the entry point `skin`, float32
    [2, vertices, 3]."""
    import wgpu

    pipeline = gpu.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "skin"})
    count, storage = len(mesh.points), wgpu.BufferUsage.STORAGE
    normals = np.column_stack([mesh.normals, np.zeros(count)]).astype(np.float32)
    out = gpu.create_buffer(size=32 * count, usage=storage | wgpu.BufferUsage.COPY_SRC)
    for result in mesh.results:
        first, second, form = numbers(result)
        chosen = np.array([first, second, count, form], np.uint32)
        buffers = [
            gpu.create_buffer_with_data(data=mesh.palette(result), usage=storage),
            gpu.create_buffer_with_data(data=packed(mesh, influences, result), usage=storage),
            gpu.create_buffer_with_data(data=normals, usage=storage),
            out,
            gpu.create_buffer_with_data(data=chosen, usage=wgpu.BufferUsage.UNIFORM),
        ]
        resources = [{"buffer": buffer} for buffer in buffers]
        read = dispatched(gpu, pipeline, resources, -(-count // 64), out).reshape(-1, 2, 4)
        yield result, read[:, :, :3].swapaxes(0, 1)


def dispatched(gpu, pipeline, resources, groups, out):
    """float32 [n] of the buffer `out`, after the pipeline has run with these resources."""
    entries = [{"binding": k, "resource": resource} for k, resource in enumerate(resources)]
    group = gpu.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = gpu.create_command_encoder()
    run = encoder.begin_compute_pass()
    run.set_pipeline(pipeline)
    run.set_bind_group(0, group)
    run.dispatch_workgroups(groups)
    run.end()
    gpu.queue.submit([encoder.finish()])
    return np.frombuffer(gpu.queue.read_buffer(out), np.float32)


def wgsl(gpu, influences):
    text = (SHADERS / "sinew.wgsl").read_text() + (SHADERS / "example.wgsl").read_text()
    text, changed = re.subn(r"SINEW_INFLUENCES: u32 = 4u;", f"SINEW_INFLUENCES: u32 = {influences}u;", text)
    assert changed == 1
    return gpu.create_shader_module(code=text)


def hlsl(gpu, influences):
    options = "-e", "skin", f"-DSINEW_INFLUENCES={influences}"
    return compiled(gpu, SHADERS / "example.hlsl", *options)


def compiled(gpu, path, *options):
    """A file of HLSL by the reference compiler for shaders of Vulkan."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("no glslangValidator: install glslang-tools to test the shaders of HLSL")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "made.spv"
        found = subprocess.run(
            [compiler, "-D", "-S", "comp", "-V", *options, "-o", str(target), str(path)],
            capture_output=True,
            text=True,
            check=False,
        )
        assert found.returncode == 0, found.stdout + found.stderr
        return gpu.create_shader_module(code=target.read_bytes())


@pytest.mark.parametrize("influences", [4, MOST])
@pytest.mark.parametrize("made", [wgsl, hlsl])
def test_compute_shader(gpu, mesh, made, influences):
    for result, (points, normals) in skinned(gpu, made(gpu, influences), mesh, influences):
        mesh.assert_is(result, points)
        mesh.assert_has_normals(result, normals)


def test_each_method_is_tested(mesh):
    used = {name for result in mesh.results for name in (result["method"], *mixed_methods(result))}
    used |= {signs for result in mesh.results for signs in result["parameters"].values()}
    assert used == {*METHODS, "blender"}
    assert {name for result in mesh.results for name in result["stages"]} == {*STAGES}


def mixed_methods(result):
    return [values["method"] for values in result["stages"].values() if "method" in values]


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("sinew.glsl", r"const int SINEW_(LBS|DQ|COR|HIERARCHY) = (\d);"),
        ("sinew.hlsl", r"const int SINEW_(LBS|DQ|COR|HIERARCHY) = (\d);"),
        ("sinew.wgsl", r"const SINEW_(LBS|DQ|COR|HIERARCHY): u32 = (\d)u;"),
    ],
)
def test_methods_have_the_same_numbers_everywhere(name, pattern):
    found = re.findall(pattern, (SHADERS / name).read_text())
    assert {method.lower(): int(number) for method, number in found} == METHODS


# Of vertex animation textures, as docs/bake.md has them.
FRAMES, ROWS, COLUMNS, VERTICES = 4, 3, 7, 19
SCALE, BIAS = (0.5, 2.0, 1.0), (0.1, 0.0, -3.0)
VAT_VERTEX = """#version 300 es
precision highp float;
precision highp int;
#include "vat.glsl"
uniform highp sampler2D animation;
uniform float frame;
uniform int rows;
in vec2 place;
out vec3 found;
void main() {
    found = sinew_vat(animation, place, frame, FRAMES, rows, vec3SCALE, vec3BIAS);
    gl_Position = vec4(0.0);
}
"""
VAT_COMPUTE = """#include "vat.hlsl"
[[vk::binding(0)]] Texture2D positions;
[[vk::binding(1)]] StructuredBuffer<float2> places;
[[vk::binding(2)]] RWStructuredBuffer<float4> found;
[[vk::binding(3)]] cbuffer Time { float time; int rows; };
[[vk::binding(4)]] Texture2D normals;
[numthreads(1, 1, 1)]
void play(uint3 id : SV_DispatchThreadID) {
    float2 uv = places[id.x];
    int frames = FRAMES;
    float rate = 2.0;
    float3 rest = float3(1.0, 2.0, 3.0), scale = float3SCALE, bias = float3BIAS;
    float3 normal_scale = float3(2.0, 2.0, 2.0), normal_bias = float3(-1.0, -1.0, -1.0);
    DOCUMENTED
    found[2 * id.x] = float4(position, 0.0);
    found[2 * id.x + 1] = float4(normal, 0.0);
}
"""


def vat_source(text, name):
    text = text.replace(f'#include "{name}"', (SHADERS / name).read_text())
    return text.replace("FRAMES", str(FRAMES)).replace("SCALE", str(SCALE)).replace("BIAS", str(BIAS))


@pytest.fixture(params=[False, True], ids=["from the top", "from the bottom"])
def animation(request):
    """Texels, places, rows of a frame, and what is to be found, by frame."""
    samples = np.random.default_rng(5).normal(size=(FRAMES, VERTICES, 3)).astype(np.float32)
    texels = np.zeros((FRAMES, ROWS * COLUMNS, 4), np.float32)
    texels[:, :VERTICES, :3] = samples
    texels = texels.reshape(FRAMES * ROWS, COLUMNS, 4)
    rows, columns = np.divmod(np.arange(VERTICES), COLUMNS)
    places = np.stack([(columns + 0.5) / COLUMNS, (rows + 0.5) / (FRAMES * ROWS)], axis=1)
    if request.param:
        texels, places = texels[::-1].copy(), places * (1.0, -1.0) + (0.0, 1.0)
    values = SCALE * samples + BIAS
    expected = {
        0.0: values[0],
        1.25: 0.75 * values[1] + 0.25 * values[2],
        3.5: 0.5 * values[3] + 0.5 * values[0],
        6.0: values[2],
    }
    return texels, places.astype(np.float32), -ROWS if request.param else ROWS, expected


def test_vertex_animation_in_glsl(gl, animation):
    texels, places, rows, expected = animation
    program = gl.program(vat_source(VAT_VERTEX, "vat.glsl"), varyings=["found"])
    texture = gl.texture((COLUMNS, FRAMES * ROWS), 4, texels.tobytes(), dtype="f4")
    texture.use(0)
    program["animation"], program["rows"] = 0, rows
    vertices = gl.vertex_array(program, [(gl.buffer(places), "2f", "place")])
    out = gl.buffer(reserve=12 * VERTICES)
    for frame, values in expected.items():
        program["frame"] = frame
        vertices.transform(out, mode=gl.POINTS)
        found = np.frombuffer(out.read(), np.float32).reshape(-1, 3)
        np.testing.assert_allclose(found, values, atol=1e-5)


def test_vertex_animation_in_hlsl(gpu, animation, tmp_path):
    """As docs/bake.md calls it."""
    import wgpu

    texels, places, rows, expected = animation
    path, document = tmp_path / "play.hlsl", (SHADERS.parent / "docs/bake.md").read_text(encoding="utf-8")
    (documented,) = re.findall(r"^```hlsl\n(.*?)^```$", document, re.MULTILINE | re.DOTALL)
    path.write_text(vat_source(VAT_COMPUTE, "vat.hlsl").replace("DOCUMENTED", documented))
    module = compiled(gpu, path, "-e", "play")
    pipeline = gpu.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "play"})
    size = (COLUMNS, FRAMES * ROWS, 1)
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    texture = gpu.create_texture(size=size, format="rgba32float", usage=usage)
    gpu.queue.write_texture(
        {"texture": texture}, texels, {"bytes_per_row": 16 * COLUMNS, "rows_per_image": size[1]}, size
    )
    storage = wgpu.BufferUsage.STORAGE
    out = gpu.create_buffer(size=32 * VERTICES, usage=storage | wgpu.BufferUsage.COPY_SRC)
    for frame, values in expected.items():
        # At two frames a second.
        time = np.float32(frame / 2).tobytes() + np.int32(rows).tobytes() + bytes(8)
        resources = [
            texture.create_view(),
            {"buffer": gpu.create_buffer_with_data(data=places, usage=storage)},
            {"buffer": out},
            {"buffer": gpu.create_buffer_with_data(data=time, usage=wgpu.BufferUsage.UNIFORM)},
            texture.create_view(),
        ]
        found = dispatched(gpu, pipeline, resources, VERTICES, out).reshape(-1, 2, 4)[:, :, :3]
        np.testing.assert_allclose(found[:, 0], values + np.array([1.0, 2.0, 3.0]), atol=1e-5)
        # The texels again, as if they were normals of whole numbers.
        normals = 2.0 * (values - BIAS) / SCALE - 1.0
        np.testing.assert_allclose(
            found[:, 1], normals / np.linalg.norm(normals, axis=1, keepdims=True), atol=1e-5
        )
