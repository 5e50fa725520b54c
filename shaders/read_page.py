# SPDX-License-Identifier: MIT
"""The data of a page of `sinew compare --viewer`, skinned as the shaders do, with numpy: docs/viewer.md."""

import base64
import json
import re
import zlib

import numpy as np
from skinning import Skinning, deformed


def read(path):
    """Returns the header of the page, and for each mesh its arrays by name."""
    text = path.read_text(encoding="utf-8")
    header, packed = (
        re.search(f'<script id="{name}"[^>]*>(.*?)</script>', text, re.DOTALL)[1]
        for name in ("header", "arrays")
    )
    header, data = json.loads(header), zlib.decompress(base64.b64decode(packed))
    meshes = []
    for part in header["parts"]:
        arrays = {}
        for name, place in part["arrays"].items():
            count, kind = int(np.prod(place["shape"])), np.dtype(place["type"]).newbyteorder("<")
            array = np.frombuffer(data, kind, count, place["offset"])
            arrays[name] = array.reshape(place["shape"])
        meshes.append(arrays)
    return header, meshes


def points(about, arrays, method, frame):
    """Points [vertices, 3] in armature space.

    about   the mesh's entry in the header
    method  one of the header's, or blender for the Armature modifier
    frame   its place in the header's frames
    """
    counts = np.diff(arrays["offsets"])
    # As many influences for each vertex as the most that one has; weights of the others are 0.
    slots = np.arange(max(counts.max(initial=1), 1)) < counts[:, None]
    bones, weights = np.zeros(slots.shape, np.int64), np.zeros(slots.shape)
    bones[slots], weights[slots] = arrays["bones"], arrays["weights"]
    still = weights.sum(axis=1) <= 1e-4
    weights[still, 0] = 1.0
    look = about["looks"][method]
    is_mixed = look["mix"] and "shares" in arrays
    by = Skinning(look["method"], look["mix"] if is_mixed else look["method"], look["by_hierarchy"])
    if look["method"] == "blender":
        by = Skinning(about["blender"], about["blender"])
    elif "masks" in arrays:
        (by.twist, by.bulge), by.form = np.clip(arrays["masks"] * look["strengths"], 0, 1).T, look["form"]
    if is_mixed:
        by.share = arrays["shares"].astype(np.float64)
    recorded = arrays[look["recorded"]][frame].T * look["step"] if look["recorded"] else 0.0
    rest, palette = arrays["rest"].astype(np.float64), arrays["palettes"][frame]
    if "moving" in arrays:
        rest[arrays["moving"]] = arrays["moved"][frame]
    if not len(arrays["bones"]):
        return rest + recorded
    found = deformed(by, rest, arrays.get("centres"), bones, weights, palette)
    return np.where(still[:, None], rest, found) + recorded
