# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects examples in the documents."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]


def blocks(document: str) -> list[tuple[str, str]]:
    """(language, text) of each block."""
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(r"^ *```(\S*)\n(.*?)^ *```$", text, re.MULTILINE | re.DOTALL)


def test_the_mesh_in_gltf():
    (text,) = [text for language, text in blocks("docs/engines.md") if language == "json"]
    example = json.loads("{" + text + "}")
    (mesh,), (skin,) = example["meshes"], example["skins"]
    writer = (ROOT / "addon/features/gltf/export.py").read_text(encoding="utf-8")
    (primitive,) = mesh["primitives"]
    own = [name for name in primitive["attributes"] if name.startswith("_")]
    assert own
    for name in (*mesh["extensions"], *own):
        assert f'"{name}"' in writer, name
    schema = json.loads((ROOT / "docs/SINEW_skinning.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(mesh["extensions"]["SINEW_skinning"], schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(mesh["extensions"]["SINEW_skinning"] | {"mix": "none"}, schema)
    of_skins = json.loads((ROOT / "docs/SINEW_skinning.skin.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(of_skins)
    jsonschema.validate(skin["extensions"]["SINEW_skinning"], of_skins)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"version": 1, "lengths": [-1.0], "twists": []}, of_skins)


def test_the_variables_of_flamenco():
    (text,) = [text for language, text in blocks("docs/flamenco.md") if language == "yaml"]
    variables = yaml.safe_load(text)["variables"]
    script = ROOT / "addon/jobs/sinew_reskin.js"
    for name, variable in variables.items():
        assert "{" + name + "}" in script.read_text(encoding="utf-8")
        assert {value["platform"] for value in variable["values"]} <= {"linux", "windows", "darwin"}
        assert all(value["value"] for value in variable["values"])


def test_the_workflow_gives_the_action_of_flex_what_it_takes():
    (text,) = [text for language, text in blocks("docs/flex.md") if language == "yaml"]
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    # YAML takes the word `on` for a truth.
    (step,) = [step for step in yaml.safe_load(text)["jobs"]["flex"]["steps"] if "files" in step["with"]]
    assert set(step["with"]) <= set(action["inputs"])
    layout = next(text for language, text in blocks("docs/flex.md") if language == "text")
    for word in step["with"]["options"].split():
        assert word.startswith("--") or word in layout or word == "dq,cor"
    used = {name for each in action["runs"]["steps"] for name in each.get("env", {})}
    assert used == {"FILES", "OPTIONS", "VERSION"}


def test_the_fixture_of_flex_is_there():
    conftest, test = [text for language, text in blocks("docs/flex.md") if language == "python"]
    module = re.search(r'"sinew_addon\.(\S+)"', conftest)[1].replace(".", "/")
    source = (ROOT / "addon" / f"{module}.py").read_text(encoding="utf-8")
    call = ast.parse(test).body[0].body[0].value
    (fixture,) = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    (check,) = [node for node in fixture.body if isinstance(node, ast.FunctionDef)]
    assert fixture.name == call.func.id
    assert {keyword.arg for keyword in call.keywords} <= {argument.arg for argument in check.args.args}


def test_the_python_program_deforms(capsys):
    program = next(text for language, text in blocks("docs/library.md") if language == "python")
    names = {}
    exec(program, names)
    points = names["deformer"].deform(names["bones"])
    # The middle vertex rotates by 90 degrees, half of the second bone's 180.
    np.testing.assert_allclose(points, [[0, 1, 0], [1, 0, 1], [2, -1, 0]], atol=1e-6)
    assert capsys.readouterr().out.startswith("[[")
