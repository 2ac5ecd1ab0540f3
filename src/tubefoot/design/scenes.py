"""What the pictures of a finger show: parts, open modules, bonding, filling, plugging, gripper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design import cad, solids
from tubefoot.design.layout import gripper_base_of
from tubefoot.design.parts import Part
from tubefoot.design.stills import Item, Picture
from tubefoot.design.surface import TriangleMesh

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

SOFT_SHOWN = (0.42, 0.46, 0.52)
"""Agilus30 black, shown lighter so that its folds are seen."""
FLUID_SHOWN = (0.80, 0.18, 0.16)


def scenes(design: FingerDesign, parts: list[Part], laid: dict[str, TriangleMesh]) -> list[Picture]:
    """The pictures of the instructions, in their order.

    design : the finger
    parts : its parts, as they are assembled
    laid : their meshes as they lie on the tray
    """
    named = {part.name: part for part in parts}
    on_end = {"view": (0.55, -1.0, 0.35), "up": (0.0, 0.0, 1.0)}
    # A long finger lies across the picture: its base to the left.
    lying = {"view": (-0.35, -1.0, 0.55), "up": (1.0, 0.0, 0.35)}
    pose = lying if design.profile.envelope[2] > 1.3 * design.profile.envelope[0] else on_end
    body = [part for part in parts if part.module]
    with_base = [*body, named["base"]]
    upper = [part for part in (named["connector"], named["plug"]) if part]
    plates = [part for part in parts if part.name == "marker plate"]
    everything = [*with_base, *upper, *plates]
    fluid = _fluid(design)
    return [
        Picture("printed-parts", _tray(parts, laid), view=(-0.25, -1.0, 1.1)),
        Picture("split-modules", _tray(body, laid), view=(-0.2, -1.0, 1.6)),
        Picture("bonded", [_placed(part) for part in body], **pose),
        Picture("filling", [*[_faint(part) for part in with_base], *fluid], **pose),
        Picture("plugged", [item for part in everything for item in _all(part)], **pose),
        Picture("gripper", _gripper(design, everything, named["gripper base"]), view=(0.35, -1.0, 0.3)),
    ]


def _shown(part: Part) -> tuple[float, float, float]:
    return SOFT_SHOWN if part.kind == "soft" else part.colour


def _placed(part: Part, shift: np.ndarray | tuple[float, ...] = (0.0, 0.0, 0.0)) -> Item:
    return Item(part.mesh.moved(np.eye(3), np.asarray(shift)), _shown(part))


def _all(part: Part, shift: tuple[float, ...] = (0.0, 0.0, 0.0)) -> list[Item]:
    return [_placed(part, np.add(shift, place)) for place in part.shifts]


def _faint(part: Part) -> Item:
    return Item(part.mesh, _shown(part), opacity=0.25)


def _fluid(design: FingerDesign) -> list[Item]:
    right = cad.triangulated(solids.chamber_fluid(design))
    half_turn = np.diag([-1.0, -1.0, 1.0])
    return [Item(right, FLUID_SHOWN), Item(right.moved(half_turn, np.zeros(3)), (0.20, 0.40, 0.80))]


def _tray(parts: list[Part], laid: dict[str, TriangleMesh]) -> list[Item]:
    """Every part once, side by side as on the tray; long parts one behind the other."""
    items, y, gap = [], 0.0, 5.0
    row_x, row_depth, width = 0.0, 0.0, 0.0
    groups: dict[str, list[Part]] = {}
    for part in parts:
        groups.setdefault(part.module or part.name, []).append(part)
    for group in groups.values():
        meshes = [laid[part.name] for part in group]
        low = np.min([mesh.bounds[0] for mesh in meshes], axis=0)
        high = np.max([mesh.bounds[1] for mesh in meshes], axis=0)
        quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        turn = quarter if high[1] - low[1] > high[0] - low[0] else np.eye(3)
        low, high = np.sort([turn @ low, turn @ high], axis=0)
        size = high - low
        width = max(width, size[0])
        if row_x > 0 and row_x + size[0] > width:
            row_x, y, row_depth = 0.0, y - row_depth - gap, 0.0
        corner = np.array([row_x - low[0], y - high[1], 0.0])
        items += [
            Item(mesh.moved(turn, corner), _shown(part)) for mesh, part in zip(meshes, group, strict=True)
        ]
        row_x, row_depth = row_x + size[0] + gap, max(row_depth, size[1])
    return items


def _gripper(design: FingerDesign, finger: list[Part], base: Part) -> list[Item]:
    items = [_placed(base)]
    for x in gripper_base_of(design).finger_x:
        for part in finger:
            if part.name != "base":
                items += _all(part, (x, 0.0, 0.0))
    return items
