"""The few operations on B-rep solids that a finger needs; build123d stays behind this module.

Importing it takes seconds: import it only where solids are made. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import build123d as b3d
import numpy as np

from tubefoot.design.outline import Outline
from tubefoot.design.surface import TriangleMesh
from tubefoot.errors import GeometryError

Solid = Any
"""A build123d shape; callers hand it on and never look inside."""

CHORD_MM = 0.01
"""Largest distance between a mesh and its solid."""
FACET_TURN_RAD = 0.2
"""Largest turn between neighbouring facets of a curved face [rad]."""


def prism(outline: Outline, y_from: float, y_to: float) -> Solid:
    """The solid between two y that has the outline as its section.

    outline : section in x-z, arcs kept as arcs
    y_from : lower face
    y_to : upper face
    """
    edges = []
    arcs = outline.rounded_corners()
    for arc, following in zip(arcs, arcs[1:] + arcs[:1], strict=True):
        if not arc.is_point:
            points = [_at(point, y_from) for point in (arc.start, arc.middle, arc.end)]
            edges.append(b3d.Edge.make_three_point_arc(*points))
        if np.linalg.norm(following.start - arc.end) > 1e-9:
            edges.append(b3d.Edge.make_line(_at(arc.end, y_from), _at(following.start, y_from)))
    face = b3d.Face(b3d.Wire(edges))
    return b3d.Solid.extrude(face, b3d.Vector(0, y_to - y_from, 0))


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Solid:
    """A block between two planes along each axis.

    x, y, z : lower and upper bound
    """
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    _require_material(min(size))
    return b3d.Solid.make_box(*size, b3d.Plane((x[0], y[0], z[0])))


def cylinder(
    foot: tuple[float, float, float], axis: tuple[float, float, float], radius: float, length: float
) -> Solid:
    """A cylinder.

    foot : centre of its first face
    axis : direction of its axis
    radius : its radius
    length : along the axis
    """
    _require_material(min(radius, length))
    return b3d.Solid.make_cylinder(radius, length, b3d.Plane(foot, z_dir=axis))


def turned(section: Sequence[tuple[float, float]], foot: tuple[float, float], upwards: bool) -> Solid:
    """The solid that a section makes when turned about an axis along z.

    section : corners as (radius, distance along the axis from the foot)
    foot : x and z of the axis' foot, at y = 0
    upwards : whether distance counts towards larger z
    """
    sign = 1.0 if upwards else -1.0
    points = [b3d.Vector(foot[0] + radius, 0.0, foot[1] + sign * along) for radius, along in section]
    face = b3d.Face(b3d.Wire.make_polygon(points, close=True))
    return b3d.Solid.revolve(face, 360.0, b3d.Axis((foot[0], 0.0, foot[1]), (0, 0, 1)))


def cut(solid: Solid, tools: Iterable[Solid]) -> Solid:
    """The solid without the tools.

    solid : what to cut
    tools : what to take away
    """
    tools = list(tools)
    return grouped(solid.cut(*tools)) if tools else solid


def joined(solids: Sequence[Solid]) -> Solid:
    """One shape of all solids; those that touch become one body.

    solids : at least one
    """
    return grouped(solids[0].fuse(*solids[1:])) if len(solids) > 1 else solids[0]


def grouped(shapes: Any) -> Solid:
    """Several bodies as one shape, without joining them.

    shapes : one shape, or any number of them
    """
    if not isinstance(shapes, list | tuple):
        return shapes
    parts = [body for shape in shapes for body in bodies(shape)]
    return parts[0] if len(parts) == 1 else b3d.Compound(children=parts)


def beyond(solid: Solid, y: float, above: bool) -> Solid:
    """The part of a solid on one side of a plane y = constant.

    solid : what to split
    y : the plane
    above : whether to keep larger y
    """
    bounds = solid.bounding_box()
    low, high = bounds.min, bounds.max
    span = (y, high.Y + 1.0) if above else (low.Y - 1.0, y)
    return grouped(solid.intersect(box((low.X - 1.0, high.X + 1.0), span, (low.Z - 1.0, high.Z + 1.0))))


def first_quadrant(solid: Solid) -> Solid:
    """The part of a solid at x >= 0, y >= 0.

    solid : what to split
    """
    bounds = solid.bounding_box()
    x, y = bounds.max.X + 1.0, bounds.max.Y + 1.0
    return grouped(solid.intersect(box((0.0, x), (0.0, y), (bounds.min.Z - 1.0, bounds.max.Z + 1.0))))


def volume(solid: Solid) -> float:
    """Volume of a solid [mm^3].

    solid : one or several bodies
    """
    return float(solid.volume)


def bodies(solid: Solid) -> list[Solid]:
    """The separate bodies of a shape.

    solid : one or several bodies
    """
    return list(solid.solids())


def require_valid(solid: Solid, name: str) -> None:
    """Raise GeometryError where the modeller left a solid with open or crossing faces.

    solid : the result of an operation
    name : what to call it
    """
    if solid is None or not solid.is_valid or solid.volume <= 0:
        raise GeometryError(
            f"{name}: the modeller made no valid solid of these dimensions; change the section that "
            "`tubefoot check` names, and report the design file where it passes"
        )


def triangulated(solid: Solid) -> TriangleMesh:
    """A closed triangle mesh within `CHORD_MM` of the solid, normals outwards.

    solid : one or several bodies
    """
    points, triangles = [], []
    count = 0
    for body in bodies(solid):
        vertices, facets = body.tessellate(CHORD_MM, FACET_TURN_RAD)
        points += [tuple(vertex) for vertex in vertices]
        triangles.append(np.array(facets) + count)
        count += len(vertices)
    return TriangleMesh.merged(np.array(points), np.concatenate(triangles))


@dataclass
class Node:
    """One entry of an assembly tree: a named solid with a colour, or a named group of entries."""

    name: str
    solid: Solid | None = None
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5)
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    children: list[Node] = field(default_factory=list)


def write_step(path: Path, root: Node) -> Path:
    """The path of a STEP file with the assembly's names and colours.

    path : file to write
    root : the assembly
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.part")
    if not b3d.export_step(_shape(root), str(beside)):
        raise GeometryError(f"{path}: the STEP file could not be written")
    beside.replace(path)
    return path


def _shape(node: Node) -> Any:
    """The node as a build123d tree; solids are placed copies, so one may stand in several places."""
    place = b3d.Location(node.shift)
    if node.solid is None:
        return b3d.Compound(label=node.name, children=[_shape(child) for child in node.children]).moved(place)
    shape = grouped(bodies(node.solid)).moved(place)
    shape.label = node.name
    shape.color = b3d.Color(*node.colour)
    return shape


def _require_material(size: float) -> None:
    if size <= 0:
        raise GeometryError(
            f"a feature is {size:.3g} mm thin, so nothing is left of it; thicken what `tubefoot check` "
            "names, or export without --compensate-growth"
        )


def _at(point: Any, y: float) -> Any:
    return b3d.Vector(float(point[0]), y, float(point[1]))
