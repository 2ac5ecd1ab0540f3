"""Input decks for CalculiX and Abaqus: mesh, Ogden material, clamp, chamber pressures, fluid cavities.

Both programs write the Ogden energy as W = sum 2 mu_i / alpha_i^2 (sum_k lbar_k^alpha_i - 3) + sum 1 / D_i
(J - 1)^(2 i), which is ours with D_1 = 2 / kappa and no further term (CalculiX and Abaqus manuals,
*HYPERELASTIC). A pressure follows its face in a geometrically nonlinear step. Half a finger is written, the
mid-plane held along y, as it is solved here. Units: mm, N, MPa, t/mm^3.

CalculiX has displacement elements only, which lock in a nearly incompressible solid; Abaqus has hybrid ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.abaqus_mesh import FACES
from tubefoot.fea.elements import element_kind
from tubefoot.fea.file_mesh import cell_faces, face_numbers
from tubefoot.fea.finger_mesh import clamp_half_finger
from tubefoot.fea.measures import RIGID_REGIONS
from tubefoot.fea.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Program = Literal["ccx", "abaqus"]
HANDS = ("right", "left")
KINDS = {"C3D8": "hexahedron8", "C3D20": "hexahedron20", "C3D10": "tetra10"}
"""Cells with the nodes, in the same order, of the elements that begin with these names."""
ELEMENTS = {"ccx": ("C3D8", "C3D8I", "C3D20", "C3D20R", "C3D10"), "abaqus": ("C3D20H", "C3D20RH", "C3D10H")}
DEFAULT_ELEMENTS = {
    ("ccx", "hexahedra"): "C3D20R",
    ("ccx", "tetrahedra"): "C3D10",
    ("abaqus", "hexahedra"): "C3D20H",
    ("abaqus", "tetrahedra"): "C3D10H",
}
NO_TERM = {"ccx": 1e20, "abaqus": 0.0}
"""Value of a further D_i that takes its term out; CalculiX would replace zero by a default."""
WATER_DENSITY = 1e-9
"""[t/mm^3]"""


@dataclass(frozen=True)
class DeckLoad:
    """What acts on the chambers, and how the step is cut.

    pressures : right, left [MPa], gauge
    pumped_volume : from the left to the right chamber of the modelled half [mm^3], in place of the pressures;
        Abaqus only, by fluid cavities
    first_increment : share of the load to begin with
    """

    pressures: tuple[float, float] = (0.0, 0.0)
    pumped_volume: float | None = None
    first_increment: float = 0.1


def cell_kind(element: str) -> str:
    """The kind of cell that an element of the other program has.

    element : its name, e.g. C3D20R

    Raises ConfigError for an unknown one.
    """
    for start, kind in KINDS.items():
        if element.startswith(start) and element in {e for names in ELEMENTS.values() for e in names}:
            return kind
    known = "; ".join(f"{program}: {', '.join(names)}" for program, names in ELEMENTS.items())
    raise ConfigError(f"element `{element}` cannot be written; {known}")


def finger_deck(
    design: FingerDesign, mesh: Mesh, element: str, load: DeckLoad, program: Program = "ccx"
) -> str:
    """The input deck of half a finger; displacements of the tip are printed at the end.

    design : for the materials; mesh : of cells of the kind of `element`
    element : name of the element; load : of the chambers; program : who reads it

    Raises ConfigError for what the program does not have, GeometryError where a wall is not the cells' own.
    """
    if element not in ELEMENTS[program] or cell_kind(element) != mesh.blocks[0].kind:
        raise ConfigError(
            f"element `{element}` does not go with {program} and cells of kind {mesh.blocks[0].kind}; "
            f"{program} has {', '.join(ELEMENTS[program])}"
        )
    if load.pumped_volume is not None and program != "abaqus":
        raise ConfigError("CalculiX has no fluid cavities; give the pressures of both chambers")
    if design.seam.modulus_mpa > 0 and design.seam.thickness_mm > 0:
        raise ConfigError("the deck has no seam film; set [seam] modulus_mpa = 0 in the design")
    lines = [
        "*HEADING",
        f"{design.name}: half finger y >= 0, base clamped; mm, N, MPa",
        *mesh_cards(mesh.points, mesh.blocks[0].nodes, element),
        *_region_cards(mesh),
        *_set_cards(mesh),
        *_material_cards(design, mesh, program),
        *(_cavity_cards(mesh) if program == "abaqus" else ()),
    ]
    for axis, points in clamp_half_finger(mesh).items():
        lines += ["*BOUNDARY", *(f"{point + 1}, {axis + 1}, {axis + 1}" for point in points)]
    lines += _step_cards(mesh, load, program)
    return "\n".join([*lines, ""])


def material_card(
    mu: Sequence[float], alpha: Sequence[float], bulk: float, program: Program = "ccx", name: str = "BODY"
) -> list[str]:
    """The lines of a nearly incompressible Ogden material of one to three terms.

    mu [MPa], alpha : terms; bulk : bulk modulus [MPa]; program : who reads it; name : of the material

    Raises ConfigError for more than three terms, which CalculiX does not have.
    """
    if len(mu) > 3:
        raise ConfigError(f"an Ogden material of {len(mu)} terms cannot be written; allowed: 1 to 3")
    terms = [number for pair in zip(mu, alpha, strict=True) for number in pair]
    numbers = [*terms, 2.0 / bulk, *[NO_TERM[program]] * (len(mu) - 1)]
    lines = [numbers[first : first + 8] for first in range(0, len(numbers), 8)]
    return [
        f"*MATERIAL, NAME={name}",
        f"*HYPERELASTIC, OGDEN, N={len(mu)}",
        *(", ".join(f"{number:.12g}" for number in line) for line in lines),
    ]


def mesh_cards(points: FloatArray, cells: IntArray, element: str) -> list[str]:
    """The lines of the nodes, set NALL, and of the elements, set ALL.

    points : (n_points, 3) [mm]; cells : (n_cells, n_nodes) point numbers; element : name of the element
    """
    rows = [*(f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(points, 1))]
    lines = ["*NODE, NSET=NALL", *rows, f"*ELEMENT, TYPE={element}, ELSET=ALL"]
    for number, nodes in enumerate(cells + 1, 1):
        entries = [str(number), *map(str, nodes)]
        lines += [", ".join(entries[:11]) + ("," if len(entries) > 11 else "")]
        lines += [", ".join(entries[11:])] if len(entries) > 11 else []
    return lines


def wall_faces(mesh: Mesh, facets: str) -> tuple[IntArray, IntArray]:
    """Cell and face number, both from 1, of each facet of a set, as the other programs count faces.

    mesh : the mesh; facets : name of the set

    Raises GeometryError where a facet is no face of a cell.
    """
    block, wall = mesh.blocks[0], mesh.facet_set(facets)
    n_corners = element_kind(wall.kind).n_corners
    cell, _, nodes = cell_faces(block.nodes, block.kind)
    theirs = [set(face) for face in FACES[block.kind]]
    own = [theirs.index(set(face[:n_corners])) for face in block.element.faces]
    rows = np.array(list(face_numbers(wall.nodes[:, :n_corners], nodes[:, :n_corners])), dtype=np.int64)
    if (rows < 0).any():
        raise GeometryError(f"{int((rows < 0).sum())} facets of `{facets}` are no faces of the cells")
    return cell[rows] + 1, np.array(own)[rows % len(own)] + 1


def _region_cards(mesh: Mesh) -> Iterator[str]:
    for number, name in enumerate(mesh.regions):
        members = np.flatnonzero(mesh.blocks[0].region == number) + 1
        if len(members):
            yield f"*ELSET, ELSET={name.upper()}"
            yield from _numbers(members)


def _set_cards(mesh: Mesh) -> Iterator[str]:
    for name in ("base", "mid_plane", "tip"):
        yield f"*NSET, NSET={name.upper()}"
        yield from _numbers(mesh.facet_set(name).points + 1)
    for hand in HANDS:
        yield f"*SURFACE, NAME=CAVITY_{hand.upper()}, TYPE=ELEMENT"
        yield from (
            f"{cell}, S{face}" for cell, face in zip(*wall_faces(mesh, f"cavity_{hand}"), strict=True)
        )


def _numbers(values: IntArray) -> Iterator[str]:
    """Eight numbers a line."""
    return (", ".join(map(str, values[first : first + 8])) for first in range(0, len(values), 8))


def _material_cards(design: FingerDesign, mesh: Mesh, program: Program) -> list[str]:
    body, rigid = design.body, design.rigid
    lines = material_card([body.scale * mu for mu in body.mu_mpa], body.alpha, body.bulk_modulus_mpa, program)
    used = [name for number, name in enumerate(mesh.regions) if (mesh.blocks[0].region == number).any()]
    if any(name in RIGID_REGIONS for name in used):
        # Neo-Hookean with the small-strain constants, as it is solved here.
        shear = rigid.youngs_modulus_mpa / (2 * (1 + rigid.poisson_ratio))
        bulk = rigid.youngs_modulus_mpa / (3 * (1 - 2 * rigid.poisson_ratio))
        lines += ["*MATERIAL, NAME=RIGID", "*HYPERELASTIC, NEO HOOKE", f"{shear / 2:.12g}, {2 / bulk:.12g}"]
    for name in used:
        material = "RIGID" if name in RIGID_REGIONS else "BODY"
        lines.append(f"*SOLID SECTION, ELSET={name.upper()}, MATERIAL={material}")
    return lines


def _cavity_cards(mesh: Mesh) -> Iterator[str]:
    """Fluid cavities; their reference nodes lie in the plane of symmetry that closes them."""
    first = len(mesh.points) + 1
    yield "*NODE"
    for number, hand in enumerate(HANDS):
        x, _, z = mesh.points[mesh.facet_set(f"cavity_{hand}").points].mean(axis=0)
        yield f"{first + number}, {x:.12g}, 0, {z:.12g}"
    for number, hand in enumerate(HANDS):
        name = hand.upper()
        yield f"*NSET, NSET=FLUID_{name}"
        yield f"{first + number}"
        yield (f"*FLUID CAVITY, NAME={name}, BEHAVIOR=WATER, REF NODE=FLUID_{name}, SURFACE=CAVITY_{name}")
    yield "*FLUID BEHAVIOR, NAME=WATER"
    yield "*FLUID DENSITY"
    yield f"{WATER_DENSITY:g}"


def _step_cards(mesh: Mesh, load: DeckLoad, program: Program) -> Iterator[str]:
    yield "*STEP, NLGEOM" + (", INC=1000" if program == "ccx" else "=YES, INC=1000")
    if program == "ccx":
        # Residual of 0.5 % of the mean force alone: its second criterion, corrections below 1 % of the
        # increment, is never met in some reduced elements, whose softest mode keeps swinging.
        yield from ("*CONTROLS, PARAMETERS=FIELD", "0.005, 1.0")
        yield from ("*CONTROLS, PARAMETERS=TIME INCREMENTATION", "4, 12, 9, 20, 10, 4, , 8")
    yield "*STATIC"
    yield f"{load.first_increment:g}, 1.0, 1e-4, 1.0"
    if load.pumped_volume is not None:
        yield "*FLUID FLUX"
        for hand, sign in zip(HANDS, (1, -1), strict=True):
            yield f"FLUID_{hand.upper()}, {sign * load.pumped_volume * WATER_DENSITY:.12g}"
    else:
        yield "*DLOAD" if program == "ccx" else "*BOUNDARY"
        for hand, pressure in zip(HANDS, load.pressures, strict=True):
            if program == "abaqus":
                yield f"FLUID_{hand.upper()}, 8, 8, {pressure:.12g}"
                continue
            cells, faces = wall_faces(mesh, f"cavity_{hand}")
            yield from (f"{cell}, P{face}, {pressure:.12g}" for cell, face in zip(cells, faces, strict=True))
    if program == "ccx":
        yield from ("*NODE FILE", "U", "*EL FILE", "S, E")
        yield from ("*NODE PRINT, NSET=TIP, FREQUENCY=1000", "U")
    else:
        yield "*OUTPUT, FIELD, VARIABLE=PRESELECT"
        yield from ("*OUTPUT, HISTORY", "*NODE OUTPUT, NSET=FLUID_RIGHT", "PCAV, CVOL")
        yield from ("*NODE OUTPUT, NSET=FLUID_LEFT", "PCAV, CVOL")
        yield from ("*NODE PRINT, NSET=TIP, FREQUENCY=1000", "U")
    yield "*END STEP"
