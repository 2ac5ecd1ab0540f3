"""The finger in CalculiX and here, on the same nested meshes, each refined until it stands still.

`python -m benchmarks.crosscheck [--bulk-mpa 50] [--refinements 1 2 3]`. Both get the same pressures, small
enough for CalculiX to converge. It has no pressure field: of its elements the one with reduced integration
locks least. A smaller bulk modulus than the design's takes the locking out of the comparison.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.convergence import divisions_of, limit
from benchmarks.finger_load import FingerLoad
from benchmarks.peers_calculix import run_finger
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.finger_model import ogden_law
from tubefoot.fea.landing import Limit
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.path import follow
from tubefoot.fea.recast import recast
from tubefoot.fea.solid import Solid
from tubefoot.fea.stride import StepControl
from tubefoot.units import KPA

PRESSURES_KPA = (5.0, -5.0)
HANDS = ("right", "left")


def one_unit(bulk_mpa: float) -> FingerDesign:
    """One unit of the default finger, its material with another bulk modulus."""
    design = FingerDesign().with_bellows(units=1)
    body = design.body.model_copy(update={"bulk_modulus_mpa": bulk_mpa})
    return design.model_copy(update={"body": body})


def load_on(design: FingerDesign, mesh: Mesh) -> FingerLoad:
    """The load case on a mesh of the design."""
    right, left = (pressure * KPA for pressure in PRESSURES_KPA)
    return FingerLoad(design, mesh, (right, left))


def theirs(design: FingerDesign, mesh: Mesh, element: str) -> float:
    """Angle by CalculiX [deg]; nan when it gave up."""
    load = load_on(design, mesh)
    with tempfile.TemporaryDirectory() as directory:
        found = run_finger(load, element, 0.5, Path(directory), threads=1)
    return float("nan") if found.displacements is None else load.bend_deg(found.displacements)


def ours(design: FingerDesign, mesh: Mesh, pressure_space: str) -> float:
    """Our angle [deg] with a pressure space."""
    load = load_on(design, mesh)
    solid = Solid(mesh, {"*": ogden_law(design.body)}, pressure=pressure_space)
    cavities = [Cavity(mesh, f"cavity_{hand}", k) for k, hand in enumerate(HANDS)]
    drive = Drive(("pressure", "pressure"), load.pressures)
    model = Model(mesh, [solid], clamp_half_finger(mesh), cavities, drive)
    step = follow(model, Limit(Control("parameter", 1.0), "load"), stepping=StepControl(states=2)).steps[-1]
    return load.bend_deg(np.reshape(step.state.unknowns[: mesh.points.size], (-1, 3)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bulk-mpa", type=float, default=50.0)
    parser.add_argument("--refinements", type=int, nargs="+", default=[1, 2, 3])
    arguments = parser.parse_args()
    design = one_unit(arguments.bulk_mpa)
    columns = {"ours, Taylor-Hood": [], "ours, C3D20": [], "ccx C3D20": [], "ccx C3D20R": []}
    print(
        f"bulk modulus {arguments.bulk_mpa:g} MPa, {PRESSURES_KPA[0]:g} and {PRESSURES_KPA[1]:g} kPa; degrees"
    )
    print("| mesh | cells | " + " | ".join(columns) + " |")
    for refinement in arguments.refinements:
        mesh = finger_mesh(design.profile, divisions=divisions_of(design, refinement))
        twenty = recast(mesh, "hexahedron20")
        row = [
            ours(design, mesh, "continuous"),
            ours(design, twenty, "none"),
            theirs(design, twenty, "C3D20"),
            theirs(design, twenty, "C3D20R"),
        ]
        for values, bend in zip(columns.values(), row, strict=True):
            values.append(bend)
        print(f"| {refinement} | {mesh.n_cells} | " + " | ".join(f"{b:.4f}" for b in row) + " |", flush=True)
    if len(arguments.refinements) >= 3:
        limits = [limit(arguments.refinements, values) for values in columns.values()]
        print("| limit | | " + " | ".join(f"{value:.4f} (order {p:.1f})" for value, p in limits) + " |")


if __name__ == "__main__":
    main()
