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
from bone_buffer import bone_buffer
from conftest import REPOSITORY

GOLDEN, SHADERS = REPOSITORY / "tests" / "golden", REPOSITORY / "shaders"
METHODS = {"lbs": 0, "dq": 1, "cor": 2}
TOLERANCE = 1e-5
MOST = 8


class Mesh:
    """A case of the golden set as a shader takes it: in armature space, each vertex with MOST influences."""

    def __init__(self, path):
        self.case, about = reader.read(path)
        self.results = [each for each in about["results"] if is_for_shaders(each)]
        to = self.case["armature_from_mesh"]
        self.points = reader.moved_by(to, self.case["points"])
        self.centres = reader.moved_by(to, self.case["data_cor"])
        self.shares = self.case["painted"]
        self.bones = np.zeros((len(self.points), MOST), np.uint32)
        self.weights = np.zeros((len(self.points), MOST), np.float32)
        for vertex, point in enumerate(self.points):
            of, weights = stored_influences(self.case, vertex, point)
            self.bones[vertex, : len(of)], self.weights[vertex, : len(of)] = of, weights
        self.palette = bone_buffer(self.case["posed"], self.case["rest"])
        normals = np.random.default_rng(1).normal(size=self.points.shape)
        self.normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        self.tolerance = TOLERANCE * np.linalg.norm(np.ptp(self.case["points"], axis=0))

    def expected_normals(self):
        pose = reader.bones(self.case)
        result = self.normals.copy()
        for vertex, point in enumerate(self.points):
            of, weights = reader.influences(self.case, vertex, point)
            if len(of):
                q = reader_methods.blended(pose.quaternion[of], weights)
                result[vertex] = reader_methods.rotation_of(q) @ self.normals[vertex]
        return result

    def assert_is(self, result, armature_points):
        points = reader.moved_by(np.linalg.inv(self.case["armature_from_mesh"]), armature_points)
        assert np.abs(points - self.case[result["array"]]).max() <= self.tolerance, result


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
    if result["parameters"].get("signs", "blender") != "blender":
        return False
    mixed = [values["method"] for values in result["stages"].values() if "method" in values]
    return {result["method"], *mixed} <= set(METHODS) and set(result["stages"]) <= {"mix"}


def numbers(result):
    """The method and the second one."""
    first = METHODS[result["method"]]
    return first, METHODS[result["stages"]["mix"]["method"]] if result["stages"] else first


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
        "share": (mesh.shares, "1f"),
        "joints": (mesh.bones[:, :4], "4u"),
        "weights": (mesh.weights[:, :4], "4f"),
    }
    content = [
        (gl.buffer(np.ascontiguousarray(values, np.uint32 if kind == "4u" else np.float32)), kind, name)
        for name, (values, kind) in attributes.items()
    ]
    vertices = gl.vertex_array(program, content)
    bones = gl.texture((4, len(mesh.palette)), 4, mesh.palette.tobytes(), dtype="f4")
    bones.use(0)
    program["sinew_bones"] = 0
    program["clip_from_armature"].write(np.eye(4, dtype=np.float32).tobytes())
    out = gl.buffer(reserve=24 * len(mesh.points))
    for result in mesh.results:
        program["method"], program["second_method"] = numbers(result)
        vertices.transform(out, mode=gl.POINTS)
        points, normals = np.frombuffer(out.read(), np.float32).reshape(-1, 2, 3).swapaxes(0, 1)
        mesh.assert_is(result, points)
        assert np.abs(normals - mesh.expected_normals()).max() < 1e-5


def packed(mesh, influences):
    """float32 words of the struct Vertex of the compute shaders, [vertices, 8 + 2 * influences]."""
    words = np.zeros((len(mesh.points), 8 + 2 * influences), np.float32)
    words[:, :3], words[:, 3], words[:, 4:7] = mesh.points, mesh.shares, mesh.centres
    words[:, 8 : 8 + influences] = mesh.bones[:, :influences].view(np.float32)
    words[:, 8 + influences :] = mesh.weights[:, :influences]
    return words


def test_glsl_compute_shader(gl, mesh):
    shader = gl.compute_shader(glsl("example.comp"))
    vertices = packed(mesh, MOST)
    out = gl.buffer(reserve=16 * len(vertices))
    gl.buffer(mesh.palette).bind_to_storage_buffer(0)
    gl.buffer(vertices).bind_to_storage_buffer(1)
    out.bind_to_storage_buffer(2)
    for result in mesh.results:
        shader["method"], shader["second_method"] = numbers(result)
        shader.run(group_x=-(-len(vertices) // 64))
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
        chosen = np.array([*numbers(result), count, 0], np.uint32)
        buffers = [
            gpu.create_buffer_with_data(data=mesh.palette, usage=storage),
            gpu.create_buffer_with_data(data=packed(mesh, influences), usage=storage),
            gpu.create_buffer_with_data(data=normals, usage=storage),
            out,
            gpu.create_buffer_with_data(data=chosen, usage=wgpu.BufferUsage.UNIFORM),
        ]
        entries = [{"binding": k, "resource": {"buffer": buffer}} for k, buffer in enumerate(buffers)]
        group = gpu.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
        encoder = gpu.create_command_encoder()
        run = encoder.begin_compute_pass()
        run.set_pipeline(pipeline)
        run.set_bind_group(0, group)
        run.dispatch_workgroups(-(-count // 64))
        run.end()
        gpu.queue.submit([encoder.finish()])
        read = np.frombuffer(gpu.queue.read_buffer(out), np.float32).reshape(-1, 2, 4)
        yield result, read[:, :, :3].swapaxes(0, 1)


def wgsl(gpu, influences):
    text = (SHADERS / "sinew.wgsl").read_text() + (SHADERS / "example.wgsl").read_text()
    text, changed = re.subn(r"SINEW_INFLUENCES: u32 = 4u;", f"SINEW_INFLUENCES: u32 = {influences}u;", text)
    assert changed == 1
    return gpu.create_shader_module(code=text)


def hlsl(gpu, influences):
    """By the reference compiler for shaders of Vulkan."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("no glslangValidator: install glslang-tools to test the shaders of HLSL")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "skin.spv"
        options = ["-D", "-S", "comp", "-e", "skin", "-V", f"-DSINEW_INFLUENCES={influences}"]
        found = subprocess.run(
            [compiler, *options, "-o", str(target), str(SHADERS / "example.hlsl")],
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
        assert np.abs(normals - mesh.expected_normals()).max() < 1e-5


def test_each_method_is_tested(mesh):
    used = {name for result in mesh.results for name in (result["method"], *mixed_methods(result))}
    assert used == set(METHODS)
    assert any(result["stages"] for result in mesh.results)


def mixed_methods(result):
    return [values["method"] for values in result["stages"].values()]


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        ("sinew.glsl", r"const int SINEW_(LBS|DQ|COR) = (\d);"),
        ("sinew.hlsl", r"const int SINEW_(LBS|DQ|COR) = (\d);"),
        ("sinew.wgsl", r"const SINEW_(LBS|DQ|COR): u32 = (\d)u;"),
    ],
)
def test_methods_have_the_same_numbers_everywhere(name, pattern):
    found = re.findall(pattern, (SHADERS / name).read_text())
    assert {method.lower(): int(number) for method, number in found} == METHODS
