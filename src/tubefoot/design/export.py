"""From a design to print files: solids, meshes that are measured again, drawing, bill and instructions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tubefoot.design import cad, solids
from tubefoot.design.analysis_solids import write_body
from tubefoot.design.bill import bill_of_materials
from tubefoot.design.drawing import write_drawing
from tubefoot.design.instructions import write_instructions
from tubefoot.design.layout import gripper_base_of
from tubefoot.design.measure import Measured, unseen_share, wall_thicknesses
from tubefoot.design.mesh_files import remove_stale_stl, write_3mf, write_stl
from tubefoot.design.parts import Part, finger_parts, laid_meshes
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.design.scenes import scenes
from tubefoot.design.stills import draw
from tubefoot.errors import GeometryError
from tubefoot.records import write_json, write_table

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

WALL_TOLERANCE_MM = 0.03
"""Largest difference between a wall measured on a mesh and the design."""
UNSEEN_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Exported:
    """What an export wrote and measured."""

    files: list[Path]
    summary: dict[str, Any]
    walls: list[Measured]


def export_finger(
    design: FingerDesign,
    directory: Path,
    growth: float = 0.0,
    pictures: bool = True,
    say: Callable[[str], None] = lambda step: None,
) -> Exported:
    """Write every print file of a design and measure the meshes again.

    design : the finger
    directory : where to write
    growth : how far every free face is moved inwards, to make up for the printer's growth [mm]
    pictures : whether to draw the pictures of the instructions
    say : called with what is done next

    Raises GeometryError where a mesh is not closed, or its walls are not those of the design.
    """
    parts = finger_parts(design, growth, say)
    say("meshes, measured again")
    walls = _measured_walls(design, parts, growth)
    facts = [_mesh_facts(part) for part in parts]
    laid = laid_meshes(parts)
    say("STL, 3MF and STEP files")
    files = [
        write_stl(directory / "stl" / f"{part.file_stem}.stl", laid[part.name], part.name) for part in parts
    ]
    remove_stale_stl(directory / "stl", files)
    files.append(write_3mf(directory / "finger.3mf", design.name, parts))
    body = solids.whole_body(design)
    files += _step_files(design, directory, parts)
    say("drawing, bill and instructions")
    files += write_drawing(design, directory)
    bill = bill_of_materials(design, parts, laid)
    files.append(write_table(directory / "bill.csv", bill.rows))
    files.append(write_table(directory / "walls.csv", [wall.row() for wall in walls]))
    drawn = draw(scenes(design, parts, laid), directory / "pictures") if pictures else {}
    files += drawn.values()
    files.append(write_instructions(directory / "instructions.html", design, bill, drawn, growth))
    summary = {
        "design": design.name,
        "growth_compensation_mm": growth,
        "body_volume_mm3": cad.volume(body),
        "chamber_volume_mm3": cad.volume(solids.chamber_fluid(design)),
        "chamber_volume_by_formula_mm3": chamber_rest_volume(design.profile),
        "wall_error_max_mm": max(wall.error for wall in walls),
        "parts": facts,
        "pictures": len(drawn),
        **bill.totals,
    }
    files.append(write_json(directory / "summary.json", summary))
    return Exported(files, summary, walls)


def _step_files(design: FingerDesign, directory: Path, parts: list[Part]) -> list[Path]:
    """The finger as an assembly, two fingers on the gripper base, and the unsplit body with named faces."""
    finger = _finger_tree(design.name, [part for part in parts if part.shifts])
    base = next(part for part in parts if part.name == "gripper base")
    on_gripper = [part for part in parts if part.shifts and part.name != "base"]
    pair = [cad.Node(base.name, base.solid, base.colour)]
    for name, x in zip(("left finger", "right finger"), gripper_base_of(design).finger_x, strict=True):
        tree = _finger_tree(name, on_gripper)
        tree.shift = (x, 0.0, 0.0)
        pair.append(tree)
    return [
        cad.write_step(directory / "finger.step", finger),
        cad.write_step(directory / "gripper.step", cad.Node(f"{design.name} gripper", children=pair)),
        write_body(directory / "body.step", design),
    ]


def _finger_tree(name: str, parts: list[Part]) -> cad.Node:
    """The assembly tree: modules with their two materials, then the other parts, copies numbered."""
    root = cad.Node(name)
    modules: dict[str, cad.Node] = {}
    for part in parts:
        owner = root
        if part.module:
            if part.module not in modules:
                modules[part.module] = cad.Node(part.module)
                root.children.append(modules[part.module])
            owner = modules[part.module]
        for number, shift in enumerate(part.shifts, start=1):
            label = part.name if len(part.shifts) == 1 else f"{part.name} {number}"
            owner.children.append(cad.Node(label, part.solid, part.colour, shift))
    return root


def _measured_walls(design: FingerDesign, parts: list[Part], growth: float) -> list[Measured]:
    """Walls of both modules, measured half way up the chambers where neither lip nor tube is cut."""
    half_chamber = design.profile.height / 2 - design.profile.side_wall
    walls = []
    for part in parts:
        if part.name in ("front body", "back body"):
            lip_depth = design.registration.lip_height_mm + design.registration.clearance_mm + growth
            y = max(half_chamber / 2, min(lip_depth + 0.1, 0.9 * half_chamber))
            plane = -y if part.name == "front body" else y
            found = wall_thicknesses(part.mesh, design.profile, plane, growth)
            walls += [replace(wall, part=part.name) for wall in found]
    worst = max(walls, key=lambda wall: wall.error)
    if worst.error > WALL_TOLERANCE_MM:
        raise GeometryError(
            f"{worst.name}: the exported mesh measures {worst.least:.3f} to {worst.greatest:.3f} mm, "
            f"the design says {worst.designed:.3f} mm (allowed: {WALL_TOLERANCE_MM} mm); "
            "report this design file"
        )
    return walls


def _mesh_facts(part: Part) -> dict[str, Any]:
    """What the part's mesh measures; it must be closed, and its whole surface in reach of a jet."""
    mesh = part.mesh
    open_edges, unseen = mesh.open_edges(), unseen_share(mesh)
    if open_edges or mesh.volume <= 0:
        raise GeometryError(
            f"{part.name}: the mesh has {open_edges} open edges and {mesh.volume:.4g} mm^3, "
            "so it cannot be printed; report this design file"
        )
    if unseen > UNSEEN_TOLERANCE:
        raise GeometryError(
            f"{part.name}: {100 * unseen:.2g} % of its surface is out of reach of any straight jet, "
            "so support would stay inside; widen the openings that `tubefoot check` names"
        )
    return {
        "part": part.name,
        "bodies": len(cad.bodies(part.solid)),
        "triangles": len(mesh.triangles),
        "open_edges": open_edges,
        "volume_mm3": mesh.volume,
        "solid_volume_mm3": part.volume,
        "unseen_surface_share": unseen,
    }
