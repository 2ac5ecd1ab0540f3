"""Meshes in Abaqus and CalculiX input files: nodes, elements, node sets, element sets, surfaces.

Only what makes the mesh is read; materials, steps and loads are not. Parts and instances are not placed: a
file with one part, or a flat one, is meant. Node order of the solid elements is that of VTK.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.file_mesh import SOLID_KINDS, FileMesh, assembled

IntArray = NDArray[np.int64]

SOLID_TYPES = {4: "tetra", 10: "tetra10", 8: "hexahedron", 20: "hexahedron20"}
SHELL_TYPES = {3: "triangle", 6: "triangle6", 4: "quad", 8: "quad8", 65: "triangle6"}
NODES = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20}
NODES |= {"triangle": 3, "triangle6": 6, "quad": 4, "quad8": 8}
SHELLS = ("S", "STRI", "CPS", "CPE", "CAX", "M3D", "SFM3D", "R3D")

FACES = {
    "tetra4": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "hexahedron8": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of the faces 1, 2, ... of an element, as the programs number them."""
FACES |= {"tetra10": FACES["tetra4"]}
FACES |= {"hexahedron20": FACES["hexahedron8"], "hexahedron27": FACES["hexahedron8"]}


@dataclass
class _Content:
    """What a file says: everything by the labels that it uses."""

    nodes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)


def read_abaqus(path: Path) -> FileMesh:
    """The mesh in an Abaqus input file.

    path : .inp file

    Raises ConfigError where the file cannot be understood, GeometryError for elements that cannot be solved.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    content = _Content()
    for keyword, options, rows in _blocks(text):
        try:
            _take(content, keyword, options, rows)
        except ValueError as error:
            raise ConfigError(f"{path}: *{keyword.upper()}: {error}") from error
    if not content.nodes or not content.elements:
        raise ConfigError(f"{path}: holds no *NODE or no *ELEMENT; included files are not followed")
    return _as_mesh(content, str(path))


def _blocks(text: str) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Keyword, options and data rows of each block; a row that ends with a comma goes on in the next."""
    keyword, going_on = "", False
    options: dict[str, str] = {}
    rows: list[list[str]] = []
    for raw in [*text.splitlines(), "*END"]:
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            if keyword:
                yield keyword, options, rows
            head, *rest = (part.strip() for part in line[1:].split(","))
            keyword, rows, going_on = head.lower(), [], False
            pairs = (part.partition("=") for part in rest if part)
            options = {name.strip().lower(): value.strip() for name, _, value in pairs}
            continue
        cells = [cell.strip() for cell in line.rstrip(",").split(",")]
        if going_on:
            rows[-1] += cells
        else:
            rows.append(cells)
        going_on = line.endswith(",") and keyword == "element"


def _take(content: _Content, keyword: str, options: dict[str, str], rows: list[list[str]]) -> None:
    if keyword == "node":
        for row in rows:
            content.nodes[int(row[0])] = tuple(float(cell) for cell in row[1:4])
        if "nset" in options:
            content.node_sets.setdefault(options["nset"].lower(), []).extend(int(row[0]) for row in rows)
    elif keyword == "element":
        kind = _cell_type(options.get("type", ""))
        for row in _whole_rows(rows, kind):
            content.elements[int(row[0])] = (kind, [int(cell) for cell in row[1:]])
        if "elset" in options:
            labels = [int(row[0]) for row in _whole_rows(rows, kind)]
            content.element_sets.setdefault(options["elset"].lower(), []).extend(labels)
    elif keyword in ("nset", "elset"):
        sets = content.node_sets if keyword == "nset" else content.element_sets
        sets.setdefault(options[keyword].lower(), []).extend(_labels(rows, "generate" in options, sets))
    elif keyword == "surface" and options.get("type", "element").lower() == "element":
        pairs = [(row[0], row[1] if len(row) > 1 else "") for row in rows]
        content.surfaces.setdefault(options["name"].lower(), []).extend(pairs)


def _cell_type(element: str) -> str:
    match = re.match(r"([A-Z]+3D|[A-Z]+)(\d+)", element.upper())
    letters, number = (match[1], int(match[2])) if match else (element, 0)
    if letters == "C3D" and number in SOLID_TYPES:
        return SOLID_TYPES[number]
    if letters in SHELLS and number in SHELL_TYPES:
        return SHELL_TYPES[number]
    known = ", ".join(f"C3D{n}" for n in sorted(SOLID_TYPES))
    raise ValueError(f"element type `{element}` cannot be used; solids: {known}; shells of 3, 4, 6, 8 nodes")


def _whole_rows(rows: list[list[str]], kind: str) -> list[list[str]]:
    """Rows of one element each; Abaqus also breaks a row without a comma at its end."""
    wanted = 1 + NODES[kind]
    whole: list[list[str]] = []
    for row in rows:
        if whole and len(whole[-1]) < wanted:
            whole[-1] = whole[-1] + row
        else:
            whole.append(row)
    if any(len(row) != wanted for row in whole):
        raise ValueError(f"an element of {NODES[kind]} nodes has another number of them")
    return whole


def _labels(rows: list[list[str]], generate: bool, sets: dict[str, list[int]]) -> Iterator[int]:
    for row in rows:
        if generate:
            first, last, *step = (int(cell) for cell in row if cell)
            yield from range(first, last + 1, *step)
            continue
        for cell in filter(None, row):
            if re.fullmatch(r"\d+", cell):
                yield int(cell)
            elif cell.lower() in sets:
                yield from sets[cell.lower()]
            else:
                raise ValueError(f"the set `{cell}` is not defined above")


def _as_mesh(content: _Content, source: str) -> FileMesh:
    labels = sorted(content.nodes)
    number = {label: row for row, label in enumerate(labels)}
    points = np.array([content.nodes[label] for label in labels], float)
    parts: list[tuple[str, IntArray]] = []
    rows: dict[int, tuple[int, int]] = {}
    for kind in sorted({kind for kind, _ in content.elements.values()}):
        mine = [label for label, (other, _) in content.elements.items() if other == kind]
        try:
            cells = [[number[node] for node in content.elements[label][1]] for label in mine]
        except KeyError as error:
            raise GeometryError(f"{source}: an element uses node {error}, which is not defined") from None
        rows |= {label: (len(parts), row) for row, label in enumerate(mine)}
        parts.append((kind, np.array(cells, dtype=np.int64)))
    sets = {}
    for name, members in content.element_sets.items():
        places = [rows[label] for label in members if label in rows]
        sets[name] = [np.array([row for part, row in places if part == k], int) for k in range(len(parts))]
    mesh = assembled(points, parts, sets, source)
    for name, nodes in content.node_sets.items():
        mesh.point_sets[name] = np.unique([number[node] for node in nodes if node in number])
    for name, pairs in content.surfaces.items():
        mesh.facet_sets[name] = _surface(content, pairs, number, source, name)
    return mesh


def _surface(
    content: _Content, pairs: list[tuple[str, str]], number: dict[int, int], source: str, name: str
) -> IntArray:
    """Corner numbers of a surface of element faces, (n, 3 or 4)."""
    facets = []
    for member, face in pairs:
        labels = [int(member)] if member.isdigit() else content.element_sets.get(member.lower())
        if labels is None:
            raise ConfigError(
                f"{source}: surface `{name}` names the element set `{member}`, which is missing"
            )
        for label in labels:
            kind, nodes = content.elements[label]
            corners = _face_corners(kind, face, f"{source}: surface `{name}`, element {label}")
            facets.append([number[nodes[corner]] for corner in corners])
    return np.array(facets, dtype=np.int64)


def _face_corners(kind: str, face: str, where: str) -> tuple[int, ...]:
    if kind not in SOLID_KINDS:
        return tuple(range(element_kind(kind).n_corners))
    faces = FACES[SOLID_KINDS[kind]]
    match = re.fullmatch(r"[sS](\d)", face)
    if match is None or not 1 <= int(match[1]) <= len(faces):
        raise ConfigError(f"{where}: face `{face}` is not one of S1 to S{len(faces)}")
    return faces[int(match[1]) - 1]
