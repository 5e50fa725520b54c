# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages made by the command of the everyday environment, and browsers that show them."""

import json
import os
import subprocess
from pathlib import Path

import browsers
import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
SINEW = REPOSITORY / ".venv" / "bin" / "sinew"
# The wrist with a shape key that swells a part of it.
ADD_KEY = """
import os, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
wrist = bpy.data.objects["Wrist"]
wrist.shape_key_add(name="Basis")
key = wrist.shape_key_add(name="Swollen")
for point in key.data[1000:3000]:
    point.co.y *= 1.5
for frame, value in ((1, 0.0), (24, 1.0)):
    key.value = value
    key.keyframe_insert("value", frame=frame)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])
sys.stdout.flush()
os._exit(0)
"""


@pytest.fixture(scope="module", params=browsers.ALL, ids=lambda kind: kind.__name__.lower())
def browser(request):
    missing = request.param.missing()
    if missing:
        sentence = f"install {missing} to test the page in this browser"
        # What runs for each change is to have it.
        (pytest.fail if "CI" in os.environ else pytest.skip)(sentence)
    with request.param() as opened:
        yield opened


def sinew(*words, status=0):
    done = subprocess.run([SINEW, *map(str, words)], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout


class Made:
    """A page, and what `sinew points` has for it."""

    def __init__(self, folder, source, frames, methods, options=(), first="dq"):
        kind = "mix" if "mix." in str(options) else "".join(options)
        self.page, self.frames = folder / f"{source.stem}{kind}.html", frames
        sinew("compare", source, "--methods", ",".join(methods), "--viewer", self.page, *options)
        self.points = {}
        for method in [first] if kind == "mix" else methods:
            out = folder / f"{self.page.stem}-{method}.npz"
            words = "--frames", ",".join(map(str, frames)), "--out", out
            sinew("points", source, "--method", method, *words, *options)
            arrays = np.load(out)
            (name,) = set(arrays.files) - {"frames"}
            self.points["mix" if kind == "mix" else method] = arrays[name]


@pytest.fixture(scope="session")
def bent(tmp_path_factory):
    """A page of Flex, with a twist that only dual quaternions stand, and a limit that no rig passes; and the
    report."""
    folder, source = tmp_path_factory.mktemp("flex"), REPOSITORY / "blend_files/elbow.blend"
    page, table = folder / "bent.html", folder / "table.toml"
    table.write_text('[limits]\npivot = 0.01\n[joints]\nother = ["twist 170"]\n', encoding="utf-8")
    words = "--poses", table, "--methods", "dq,lbs", "--json", "--viewer", page
    text = sinew("flex", source, *words, status=1)
    return page, json.loads(text)[0]


@pytest.fixture(scope="session")
def varied(tmp_path_factory):
    """A page of variants that differ in stages, by their keys; the last two are recorded."""
    page = tmp_path_factory.mktemp("variants") / "wrist.html"
    keys = "=blender", "Soft=dq+twist_spread:amount=0.8", "=dq:signs=hierarchy+bulge_limit", "=lbs"
    keys += "=dq+twist_spread+delta_mush", "=qv"
    source = REPOSITORY / "blend_files/wrist.blend"
    sinew("compare", source, "--variants", ",".join(keys), "--frames", "1,12,24", "--viewer", page)
    return page, keys


@pytest.fixture(scope="session")
def sheet(tmp_path_factory):
    """A page with a contact sheet."""
    page = tmp_path_factory.mktemp("sheet") / "elbow.html"
    source, variants = REPOSITORY / "blend_files/elbow.blend", "blender, dq, Soft=dq+delta_mush"
    sinew("compare", source, "--sheet", page.with_suffix(".png"), "--variants", variants, "--viewer", page)
    return page


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """By name: files whose meshes are in armature space, so that it is the space of `sinew points`."""
    folder, files = tmp_path_factory.mktemp("pages"), REPOSITORY / "blend_files"
    methods = ["blender", "lbs", "dq", "cor"]
    words = [SINEW.with_name("python"), "-c", ADD_KEY, files / "wrist.blend", folder / "keyed.blend"]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    mix = "--set", "mix.method=cor", "--set", "mix.group=Hand"
    stages = (
        "twist_spread=on",
        "twist_spread.amount=0.8",
        "bulge_limit=on",
        "bulge_limit.group=Hand",
        "dq.signs=hierarchy",
    )
    staged = [word for setting in stages for word in ("--set", setting)]
    found = {
        "wrist": Made(folder, files / "wrist.blend", [1, 12, 24], methods),
        "mix": Made(folder, files / "wrist.blend", [12, 24], ["dq"], mix),
        "staged": Made(folder, files / "wrist.blend", [1, 12, 24], methods, staged),
        "keyed": Made(folder, folder / "keyed.blend", [1, 12, 24], methods),
        "shoulder": Made(folder, files / "shoulder.blend", [1, 12, 24], methods),
    }
    rigs = Path(os.environ.get("SINEW_RIGS", "/none"), "human.blend")
    if rigs.exists():
        found["human"] = Made(folder, rigs, [1, 16, 40], methods)
    return found
