"""`python -m benchmarks.convergence [--units N] [--refinements 1 2 3]`: which element, which mesh.

Solves a finger to P_right = 35 kPa on nested meshes (each line of the coarsest cut into 1, 2, 3, ... cells)
with three pressure spaces of the 27-node hexahedron: Taylor-Hood, discontinuous linear, and none
(displacement only, which locks). Prints the table of docs/verification.md and writes build/convergence.json;
the limit of each family is extrapolated from meshes that halve twice (1, 2, 4), where there are such, since
these are nested in each other, else from the three finest; once more from the two finest with the order of
the chambers' corners. The default mesh stands apart.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import DEFAULT_ELEMENT_SIZE, clamp_half_finger, finger_mesh
from tubefoot.fea.finger_model import ogden_law
from tubefoot.fea.landing import Limit
from tubefoot.fea.measures import SectionRotation, Stresses, percentile
from tubefoot.fea.path import follow
from tubefoot.fea.profile_mesh import Divisions
from tubefoot.fea.solid import Solid
from tubefoot.fea.stride import StepControl
from tubefoot.records import write_json
from tubefoot.units import DEG, KPA

FAMILIES = {"continuous": "Taylor-Hood", "linear": "discontinuous linear", "none": "displacement only"}
COARSEST_MM = 3.0
CORNER_ORDER = 2 * 0.5445
"""Order in h of integrals over a body with a corner of 270 degrees of solid, as the chambers have: twice the
exponent of the displacement there (Williams 1952, free faces)."""


def divisions_of(design: FingerDesign, refinement: int | None) -> Divisions:
    """Cells along each line: of the default mesh where no refinement is given."""
    if refinement is None:
        return Divisions.of(design.profile, DEFAULT_ELEMENT_SIZE)
    return Divisions.of(design.profile, COARSEST_MM).refined(refinement)


def solve(design: FingerDesign, refinement: int | None, space: str) -> dict[str, float]:
    """Angle, suction pressure and stress at 35 kPa on one mesh."""
    mesh = finger_mesh(design.profile, divisions=divisions_of(design, refinement))
    solid = Solid(mesh, {"*": ogden_law(design.body)}, pressure=space)
    cavities = [Cavity(mesh, f"cavity_{hand}", k) for k, hand in enumerate(("right", "left"))]
    model = Model(mesh, [solid], clamp_half_finger(mesh), cavities, Drive.pump())
    started, cpu = time.perf_counter(), time.process_time()
    goal = Limit(Control("pressure", 35 * KPA), "goal")
    last = follow(model, goal, stepping=StepControl(states=4)).steps[-1]
    stresses = Stresses.of(mesh, solid, last.state)
    angle, _ = SectionRotation(mesh, mesh.facet_set("tip").points)(last.state.unknowns)
    return {
        "cells": mesh.n_cells,
        "unknowns": model.system.size,
        "bend_deg": angle / DEG,
        "pressure_left_kpa": float(last.state.pressures[1]) / KPA,
        "von_mises_p99_kpa": percentile(stresses.von_mises, stresses.weights, 0.99) / KPA,
        "min_jacobian": last.min_jacobian,
        "wall_s": time.perf_counter() - started,
        "cpu_s": time.process_time() - cpu,
    }


def limit(refinements: list[int], values: list[float]) -> tuple[float, float]:
    """The value that a + b h^p tends to, through three meshes, and the order p.

    Where the last changes do not shrink like a power, the finest value stands and the order is NaN.
    """
    halving = [(n, 2 * n, 4 * n) for n in refinements if {2 * n, 4 * n} <= {*refinements}]
    chosen = halving[-1] if halving else tuple(refinements[-3:])
    h = 1.0 / np.array(chosen, dtype=float)
    v = np.array([values[refinements.index(n)] for n in chosen])
    wanted = (v[0] - v[1]) / (v[1] - v[2])
    orders = np.linspace(0.3, 6.0, 5701)
    ratios = (h[0] ** orders - h[1] ** orders) / (h[1] ** orders - h[2] ** orders)
    best = int(np.argmin(np.abs(ratios - wanted)))
    if abs(ratios[best] - wanted) > 0.02 * abs(wanted):
        return float(v[-1]), float("nan")
    power = orders[best]
    slope = (v[1] - v[2]) / (h[1] ** power - h[2] ** power)
    return float(v[2] - slope * h[2] ** power), float(power)


def limit_at_corners(refinements: list[int], values: list[float]) -> float:
    """The value that a + b h^`CORNER_ORDER` tends to, through the two finest meshes."""
    coarse, fine = (1.0 / n**CORNER_ORDER for n in refinements[-2:])
    return values[-1] + (values[-1] - values[-2]) * fine / (coarse - fine)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=3)
    parser.add_argument("--refinements", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--families", nargs="+", default=list(FAMILIES), choices=FAMILIES)
    arguments = parser.parse_args()
    design = FingerDesign().with_bellows(units=arguments.units)
    table: dict[str, list[dict[str, float | None]]] = {}
    print("| pressure space | mesh | cells | unknowns | angle [deg] | P_left [kPa] | p99 [kPa] | min det F |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for space in arguments.families:
        rows = table.setdefault(space, [])
        for refinement in [None, *arguments.refinements]:
            row = {"refinement": refinement, **solve(design, refinement, space)}
            rows.append(row)
            write_json(Path(f"build/convergence-{arguments.units}.json"), table)
            print(
                f"| {FAMILIES[space]} | {refinement or 'default'} | {row['cells']} | {row['unknowns']} | "
                f"{row['bend_deg']:.3f} | "
                f"{row['pressure_left_kpa']:.2f} | {row['von_mises_p99_kpa']:.1f} | "
                f"{row['min_jacobian']:.2f} |",
                flush=True,
            )
        if len(arguments.refinements) >= 3:
            nested = rows[1:]
            angle, angle_order = limit(arguments.refinements, [row["bend_deg"] for row in nested])
            lefts = [row["pressure_left_kpa"] for row in nested]
            left, left_order = limit(arguments.refinements, lefts)
            print(
                f"| {FAMILIES[space]} | limit | | | {angle:.3f} (order {angle_order:.1f}) | "
                f"{left:.2f} (order {left_order:.1f}) | | |",
                flush=True,
            )
            at_corners = [
                limit_at_corners(arguments.refinements, [row[key] for row in nested])
                for key in ("bend_deg", "pressure_left_kpa")
            ]
            print(
                f"| {FAMILIES[space]} | limit, order {CORNER_ORDER:.2f} | | | {at_corners[0]:.3f} | "
                f"{at_corners[1]:.2f} | | |",
                flush=True,
            )


if __name__ == "__main__":
    main()
