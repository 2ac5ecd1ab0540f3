"""`tubefoot export --fea`: the input deck of a finger for CalculiX or Abaqus."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tubefoot.errors import ConfigError


@Parameter(name="*")
@dataclass(frozen=True)
class DeckOptions:
    """What the deck of `--fea` says; of no use without it."""

    fea: str | None = None
    """Write an input deck for ccx (CalculiX) or abaqus instead of the print files."""
    element: str | None = None
    """Element of the other program; C3D20R, C3D10 (ccx), C3D20H, C3D10H (abaqus) if not given."""
    element_size_mm: float | None = None
    """Longest edge of a cell [mm]."""
    mesh_kind: str = "hexahedra"
    """hexahedra (swept) or tetrahedra (Netgen)."""
    ports: Annotated[bool, Parameter(negative="")] = False
    """Tubes and bores as part of the solid; with tetrahedra."""
    right_kpa: float = 35.0
    """Pressure of the right chamber, gauge [kPa]."""
    left_kpa: float = 0.0
    """Pressure of the left chamber, gauge [kPa]; `tubefoot solve` says what the coupled one is."""
    pumped_volume_ml: float | None = None
    """Volume pumped from the left to the right chamber [ml] in place of the pressures; abaqus only."""


def export_deck(design: Path, out: Path | None, options: DeckOptions) -> None:
    """Write the deck of a design and its run.toml.

    design : design file; out : directory; options : program, element, mesh, load

    Raises ConfigError for a program or element that is not known.
    """
    from dataclasses import asdict

    from tubefoot.config import parse_settings
    from tubefoot.design.finger import load_design
    from tubefoot.fea.deck import DEFAULT_ELEMENTS, ELEMENTS, DeckLoad, cell_kind, finger_deck
    from tubefoot.fea.finger_model import HALF, SolveSettings, design_mesh
    from tubefoot.fea.recast import recast
    from tubefoot.records import Run, write_whole
    from tubefoot.units import KPA, ML

    if options.fea not in ELEMENTS:
        raise ConfigError(f"--fea {options.fea}: allowed are {', '.join(ELEMENTS)}")
    finger = load_design(design)
    table: dict[str, Any] = {"mesh_kind": options.mesh_kind, "ports": options.ports}
    if options.element_size_mm is not None:
        table["element_size_mm"] = options.element_size_mm
    settings = parse_settings(table, SolveSettings, source="export")
    element = options.element or DEFAULT_ELEMENTS[options.fea, settings.mesh_kind]
    mesh = recast(design_mesh(finger, settings), cell_kind(element))
    pumped = options.pumped_volume_ml
    load = DeckLoad(
        (options.right_kpa * KPA, options.left_kpa * KPA), None if pumped is None else HALF * pumped * ML
    )
    text = finger_deck(finger, mesh, element, load, "ccx" if options.fea == "ccx" else "abaqus")
    record = {"design_file": design, **asdict(options), "design": finger.model_dump()}
    run = Run(out or Path("out/export") / design.stem, "export", record)
    path = write_whole(run.path(f"{finger.name}-{options.fea}.inp"), text)
    run.finish(elements=mesh.n_cells, nodes=len(mesh.points))
    print(f"{mesh.n_cells} elements {element}, {len(mesh.points)} nodes, half of the finger")
    print(f"input deck: {path}")
