# SPDX-License-Identifier: GPL-3.0-or-later
"""The stub, which editors read, and the module, which help() reads, have the same descriptions."""

import ast
import re
from pathlib import Path

import pytest
import sinew
from sinew import _native

STUB = ast.parse((Path(__file__).parents[2] / "native/python/sinew/_native.pyi").read_text())


def described():
    """(name, docstring, object) for everything in the stub that has or should have a docstring."""
    for node in STUB.body:
        if isinstance(node, ast.FunctionDef):
            yield pytest.param(ast.get_docstring(node), getattr(_native, node.name), id=node.name)
        if isinstance(node, ast.ClassDef):
            of = getattr(_native, node.name)
            yield pytest.param(ast.get_docstring(node), of, id=node.name)
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    name = f"{node.name}.{member.name}:{member.lineno}"
                    yield pytest.param(ast.get_docstring(member), getattr(of, member.name), id=name)


def words(text):
    return re.sub(r"\s+", " ", text or "").strip()


@pytest.mark.parametrize(("stub", "of"), list(described()))
def test_the_stub_says_what_the_module_says(stub, of):
    assert words(stub)
    assert words(stub) in words(of.__doc__)


def test_the_stub_has_all_that_the_module_has():
    def of_stub(body):
        return {node.name for node in body if isinstance(node, ast.ClassDef | ast.FunctionDef)}

    def of_module(of):
        return {
            name for name, value in vars(of).items() if not name.startswith("_") and hasattr(value, "__doc__")
        }

    modules = {"affine", "dual", "dual_quat", "fit", "ik", "interpolate", "quat", "quat_vec", "spline"}
    assert of_stub(STUB.body) == of_module(_native) - modules
    for node in STUB.body:
        if isinstance(node, ast.ClassDef):
            assert of_stub(node.body) - {"__init__"} == of_module(getattr(_native, node.name)), node.name


@pytest.mark.parametrize("module", [sinew.affine, sinew.quat_vec, sinew.dual_quat], ids=lambda m: m.__name__)
def test_every_function_of_a_representation_is_there_and_described(module):
    native = getattr(_native, module.__name__.rsplit(".", 1)[1])
    own = "to_" + module.__name__.rsplit(".", 1)[1]
    functions = {name for name in vars(native) if not name.startswith("_")} - {own}
    assert set(module.__all__) == functions | {"identity"}
    for name in module.__all__:
        assert words(getattr(module, name).__doc__), name
