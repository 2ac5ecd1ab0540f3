"""Every public function and method of the package says what each of its public parameters is.

In its docstring, by name; a verb of the command line may say it in the annotation, `Parameter(help=...)`.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[1] / "src" / "tubefoot"

Function = ast.FunctionDef | ast.AsyncFunctionDef


def public_functions(tree: ast.Module) -> Iterator[tuple[str, Function, str]]:
    """Name, function and the docstrings in which its parameters may be described."""
    for node in tree.body:
        if isinstance(node, Function) and not node.name.startswith("_"):
            yield node.name, node, ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            of_class = ast.get_docstring(node) or ""
            for member in node.body:
                if not isinstance(member, Function):
                    continue
                text = ast.get_docstring(member) or ""
                if member.name == "__init__":
                    yield f"{node.name}.__init__", member, of_class + text
                elif not member.name.startswith("_"):
                    yield f"{node.name}.{member.name}", member, text


def undocumented(source: str) -> list[str]:
    """`function: parameter` for each public parameter that no docstring of its function names."""
    found = []
    tree = ast.parse(source)
    helpful = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign) and "help=" in ast.unparse(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for name, function, text in public_functions(tree):
        given = function.args
        parameters = [*given.posonlyargs, *given.args, *given.kwonlyargs]
        parameters += [extra for extra in (given.vararg, given.kwarg) if extra]
        for parameter in parameters:
            if parameter.arg in ("self", "cls") or parameter.arg.startswith("_"):
                continue
            annotation = ast.unparse(parameter.annotation) if parameter.annotation else ""
            if annotation in helpful or "help=" in annotation:
                continue
            if not re.search(rf"\b{re.escape(parameter.arg)}\b", text):
                found.append(f"{name}: {parameter.arg}")
    return found


@pytest.mark.parametrize("path", sorted(SOURCES.rglob("*.py")), ids=lambda p: str(p.relative_to(SOURCES)))
def test_every_public_parameter_is_described(path):
    assert undocumented(path.read_text(encoding="utf-8")) == []


def test_a_parameter_without_description_is_found():
    source = '''
Port = Annotated[str, Parameter(help="serial port")]

def check(port: Port, seed: Annotated[int, Parameter(help="seed")], out: Path):
    """Check."""

def bend(angle, speed, _hidden):
    """Bend.

    angle : [rad]
    """

class Rig:
    """A rig.

    port : its serial port
    """

    def __init__(self, port, baud):
        """Open it."""

    def move(self, *steps, hard=False):
        """Move by steps."""

    def _secret(self, anything):
        pass

class _Private:
    def move(self, anything):
        pass
'''
    assert undocumented(source) == ["check: out", "bend: speed", "Rig.__init__: baud", "Rig.move: hard"]
