"""How the wall of one crest gives way: force over indentation, by finite elements of three units.

`python -m benchmarks.wall_indentation [--element-size-mm 2]`. Both caps are held; a rigid body, a box as long
as a crest or a ball, presses the crest of the middle unit on one side, both chambers at given pressures. The
indentation is the body's way less that of the finger's side line behind it. It is what a chain of rigid links
with hinges leaves out.
"""

import argparse
from pathlib import Path

import numpy as np

from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.finger_model import HALF, ogden_law
from tubefoot.fea.obstacle import Box, Obstacle, Sphere
from tubefoot.fea.solid import Solid
from tubefoot.records import write_table
from tubefoot.units import KPA

DESIGN = Path("examples/designs/reference-3.toml")
BARRIER = Barrier(reach=0.05, stiffness=20.0)
RADIUS_MM = 7.5


def indent(
    design: FingerDesign, body: str, pressures_kpa: tuple[float, float], size_mm: float, ways_mm: list[float]
) -> list[dict]:
    """Rows of indentation and force, whole finger; the body goes the ways one after the other."""
    mesh, profile = finger_mesh(design.profile, size_mm), design.profile
    held = clamp_half_finger(mesh)
    tip = mesh.facet_set("tip").points
    held = {axis: np.union1d(points, tip) for axis, points in held.items()}
    height, face = 1.5 * profile.pitch, -profile.crest_outside

    def shape(way: float) -> Box | Sphere:
        front = face + way - BARRIER.reach
        if body == "ball":
            return Sphere((front - RADIUS_MM, 0.0, height), RADIUS_MM)
        return Box((front - 5.0, 0.0, height), (10.0, 20.0, profile.crest_flat + 1.0), 0.5)

    wall = Obstacle(mesh, "crest_outside_left", shape(-1.0), BARRIER)
    cavities = [Cavity(mesh, f"cavity_{hand}", k) for k, hand in enumerate(("right", "left"))]
    drive = Drive(("pressure", "pressure"), tuple(value * KPA for value in pressures_kpa))
    model = Model(mesh, [Solid(mesh, {"*": ogden_law(design.body)})], held, cavities, drive, [wall])
    side = mesh.facet_set("side").points
    line = side[np.abs(mesh.points[side, 0]) < 1e-9]
    behind = line[np.argmin(np.abs(mesh.points[line, 2] - height))]
    crest = mesh.facet_set("crest_outside_left").points
    crest = crest[np.abs(mesh.points[crest, 2] - height) < profile.crest_flat / 2 + 1e-6]
    state = model.rest()
    for share in (0.25, 0.5, 0.75, 1.0):
        state = model.solve(state, Control("parameter", share)).state
    rest = float((state.unknowns[3 * crest] - state.unknowns[3 * behind]).mean())
    # The crest has moved with its pressure; the way is counted from there.
    start = float(state.unknowns[3 * crest].min())
    from_side = start - float(state.unknowns[3 * behind])
    rows = []
    for way in ways_mm:
        wall.shape = shape(start + way)
        state = model.solve(state, Control("parameter", 1.0)).state
        model.evaluate(state, stiff=False)
        moved = float(state.unknowns[3 * behind])
        mean = float((state.unknowns[3 * crest] - state.unknowns[3 * behind]).mean()) - rest
        force = -float(wall.force[0]) / HALF
        rows.append(
            {
                "body": body,
                "pressure_right_kpa": pressures_kpa[0],
                "pressure_left_kpa": pressures_kpa[1],
                "element_size_mm": size_mm,
                "force_n": force,
                "indentation_mm": start + way - moved - from_side,
                "crest_mean_mm": mean,
                "patch_mm2": float(wall.areas[wall.gaps < BARRIER.reach].sum()) / HALF,
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--element-size-mm", type=float, default=2.0)
    parser.add_argument("--ways-mm", type=float, nargs="+", default=[0.05, 0.1, 0.2, 0.3, 0.4])
    parser.add_argument(
        "--right-kpa", type=float, nargs="+", default=[0.0, 20.0, -20.0], help="left: opposite"
    )
    parser.add_argument("--bodies", nargs="+", choices=("box", "ball"), default=["box", "ball"])
    parser.add_argument("--out", type=Path, default=Path("build/wall_indentation"))
    asked = parser.parse_args()
    rows = []
    for body in asked.bodies:
        for right in asked.right_kpa:
            pressures = (right, -right)
            found = indent(load_design(DESIGN), body, pressures, asked.element_size_mm, asked.ways_mm)
            rows += found
            for row in found:
                print(
                    f"{body:5s} right {pressures[0]:5.0f} kPa: {row['force_n']:.4f} N at "
                    f"{row['indentation_mm']:.3f} mm, {row['force_n'] / row['indentation_mm']:.3f} N/mm, "
                    f"patch {row['patch_mm2']:.1f} mm2, crest in the mean {row['crest_mean_mm']:.3f} mm",
                    flush=True,
                )
    print(f"written: {write_table(asked.out / 'indentation.csv', rows)}")


if __name__ == "__main__":
    main()
