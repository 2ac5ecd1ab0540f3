"""A grasp by three-unit fingers in the twin and by finite elements: what the contact itself adds.

`python -m benchmarks.short_grasp [--element-size-mm 4] [--wall-n-per-mm 1 2.5]`. Short fingers are stiff, so
that the give of wall and object counts. Same volumes, no friction, no weight, no relaxation.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from tubefoot.design.finger import load_design
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.grasp_settings import GraspedObject, GraspSettings
from tubefoot.fea.grasp_solve import solve_grasp
from tubefoot.lab.grasp_object import DamageBounds, GraspObject
from tubefoot.records import read_table, write_table
from tubefoot.reduced.files import reference_file
from tubefoot.twin.gripper import Gripper
from tubefoot.twin.gripper_scene import TIME_STEP_S, GripperMake, SceneParts
from tubefoot.twin.held_object import HeldObject
from tubefoot.units import DEG, KPA, ML

DESIGN = Path("examples/designs/reference-3.toml")
GAP_MM, OPEN_ML, STATES_ML = 9.0, -0.1, (0.05, 0.1)
SLIPPERY = 1e-3
BOX = GraspedObject(name="box", sizes_mm=(9.0, 9.0, 10.0))
BALL = GraspedObject(
    name="ball",
    shape="ellipsoid",
    sizes_mm=(9.0, 9.0, 9.0),
    youngs_modulus_kpa=800.0,
    poisson_ratio=0.45,
)
CASES = ((BOX, "box", 18.5), (BALL, "sphere", 21.5))
"""Object, its shape in the twin, its height [mm]; the ball meets the middle of a crest."""


def finite_elements(thing: GraspedObject, height_mm: float, size_mm: float, out: Path) -> list[dict]:
    """The wanted states, as rows of grasp.csv."""
    grasp = GraspSettings(
        object=thing,
        finger_gap_mm=GAP_MM,
        height_mm=height_mm,
        open_ml=OPEN_ML,
        states_ml=STATES_ML,
        object_element_mm=min(size_mm, 3.0),
    )
    settings = SolveSettings(element_size_mm=size_mm, self_contact=False, fields="none")
    directory = out / f"{thing.name}-{size_mm:g}mm"
    solve_grasp(load_design(DESIGN), directory, grasp, settings)
    return [row for row in read_table(directory / "grasp.csv") if row["pumped_volume_ml"] in STATES_ML]


def twin(thing: GraspedObject, shape: str, height_mm: float, wall_n_per_mm: float) -> list[dict]:
    """The same states in the twin's scene."""
    law = replace(reference_file().to_finger(), n_units=3)
    held = GraspObject(
        name=thing.name,
        shape=shape,
        size_mm=thing.sizes_mm,
        modulus_kpa=thing.youngs_modulus_kpa,
        poisson=thing.poisson_ratio,
        damage=DamageBounds(contact_force_n=1.0),
    )
    make = GripperMake(finger_gap_mm=GAP_MM, wall_n_per_mm=wall_n_per_mm)
    gripper = Gripper(SceneParts((law, law), make, HeldObject(held, "front", SLIPPERY)), gravity=False)
    pump(gripper, 0.0, OPEN_ML)
    gripper.place((0.0, 0.0, height_mm))
    rows, last = [], OPEN_ML
    for volume in STATES_ML:
        pump(gripper, last, volume)
        last, finger = volume, gripper.fingers[0]
        first, middle, upper = finger.unit_angles / DEG
        rows.append(
            {
                "normal_force_n": gripper.touches()[0].normal,
                "theta1_deg": first + middle / 2,
                "theta2_deg": upper + middle / 2,
                "pressure_right_kpa": finger.pressures[0] / KPA,
                "pressure_left_kpa": finger.pressures[1] / KPA,
            }
        )
    return rows


def pump(gripper: Gripper, before_ml: float, after_ml: float) -> None:
    """Move to a volume within 0.6 s, the chambers' volumes held by their pressures, and rest for 1 s."""
    for volume in np.r_[np.linspace(before_ml, after_ml, 300), np.full(500, after_ml)]:
        for finger in gripper.fingers:
            right, left = finger.pressures
            for _ in range(40):
                found = finger.volumes(right, left, TIME_STEP_S)
                miss = np.array([volume * ML - found[0], -volume * ML - found[1]])
                step = np.linalg.solve(np.array([[found[2], found[3]], [found[3], found[4]]]), miss)
                right, left = right + float(step[0]), left + float(step[1])
                if np.abs(step).max() < 1e-8:
                    break
            finger.advance(right, left, TIME_STEP_S)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--element-size-mm", type=float, default=4.0)
    parser.add_argument("--wall-n-per-mm", type=float, nargs="+", default=[GripperMake().wall_n_per_mm])
    parser.add_argument("--out", type=Path, default=Path("build/short_grasp"))
    asked = parser.parse_args()
    rows = []
    for thing, shape, height in CASES:
        solved = finite_elements(thing, height, asked.element_size_mm, asked.out)
        for wall in asked.wall_n_per_mm:
            for fea, other in zip(solved, twin(thing, shape, height, wall), strict=True):
                row = {
                    "object": thing.name,
                    "wall_n_per_mm": wall,
                    "pumped_volume_ml": fea["pumped_volume_ml"],
                }
                for key, value in other.items():
                    stem, unit = key.rsplit("_", 1)
                    row |= {f"{stem}_fea_{unit}": fea[key], f"{stem}_twin_{unit}": value}
                rows.append(row)
                print(", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{v}" for k, v in row.items()))
    print(f"written: {write_table(asked.out / 'short_grasp.csv', rows)}")


if __name__ == "__main__":
    main()
