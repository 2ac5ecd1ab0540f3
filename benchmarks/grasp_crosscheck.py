"""The grasp in the twin and by finite elements: force, angles and pressures at the same pumped volumes.

`python -m benchmarks.grasp_crosscheck [--cases tofu-front ...] [--element-size-mm 3] [--out DIR]`. Finite
elements run by `examples/grasps/CASE.toml` and are resumable; both have exact volumes, no friction, no
weight, no relaxation. Written: crosscheck.csv, with what is asked: force within 15 %, angles within 2 deg.
"""

import argparse
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tubefoot.config import load_settings
from tubefoot.design.finger import load_design
from tubefoot.errors import ConvergenceError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.grasp_settings import GraspSettings
from tubefoot.fea.grasp_solve import solve_grasp
from tubefoot.lab.grasp_object import known_object
from tubefoot.records import read_table, write_table
from tubefoot.twin.grip_state import grip_states
from tubefoot.twin.gripper_scene import GripperMake

CASES = ("tofu-front", "tofu-side", "blueberry-front", "blueberry-side")
DESIGN = Path("examples/designs/reference-12.toml")
FORCE_SHARE, ANGLE_DEG = 0.15, 2.0
"""How closely the twin shall agree."""
NO_CONTACT_N = 1e-3
"""Force below which the fingers do not touch; there the twin's must not either."""
ANGLES = ("theta1_deg", "theta2_deg")
COMPARED = (
    *ANGLES,
    "theta1_chord_deg",
    "theta2_chord_deg",
    "pressure_right_kpa",
    "pressure_left_kpa",
    "contact_height_mm",
)


def finite_elements(case: str, size_mm: float, out: Path) -> tuple[GraspSettings, list[dict]]:
    """The states at which the case is wanted, as rows of grasp.csv; as far as the solve came."""
    grasp = load_settings(Path(f"examples/grasps/{case}.toml"), GraspSettings)
    settings = SolveSettings(element_size_mm=size_mm, self_contact=False)
    directory = out / f"{case}-{size_mm:g}mm"
    try:
        solve_grasp(load_design(DESIGN), directory, grasp, settings, progress=_say)
    except ConvergenceError as error:
        print(f"{case}: {error}")
    rows = read_table(directory / "grasp.csv")
    wanted = [
        row
        for row in rows
        if row["placed"] and any(abs(row["pumped_volume_ml"] - ml) < 1e-6 for ml in grasp.states_ml)
    ]
    return grasp, wanted


def compare(case: str, size_mm: float, out: Path, make: GripperMake) -> list[dict]:
    """One row for each wanted state of a case."""
    grasp, solved = finite_elements(case, size_mm, out)
    name, pose = case.rsplit("-", 1)
    volumes = [float(row["pumped_volume_ml"]) for row in solved]
    found = grip_states(known_object(name), pose, volumes, grasp.height_mm, make)  # type: ignore[arg-type]
    return [_row(case, fea, twin) for fea, twin in zip(solved, found, strict=True)]


def _row(case: str, fea: dict, twin: object) -> dict:
    force, other = float(fea["normal_force_n"]), float(twin.normal_force_n)  # type: ignore[attr-defined]
    row = {"case": case, "pumped_volume_ml": fea["pumped_volume_ml"], "force_fea_n": force}
    row |= {"force_twin_n": other, "force_ratio": other / force if force > NO_CONTACT_N else None}
    for key in COMPARED:
        stem, unit = key.rsplit("_", 1)
        row |= {f"{stem}_fea_{unit}": fea[key], f"{stem}_twin_{unit}": getattr(twin, key)}
    apart = [abs(float(fea[key]) - getattr(twin, key)) for key in ANGLES]
    ratio = row["force_ratio"]
    row["force_agrees"] = other <= NO_CONTACT_N if ratio is None else abs(ratio - 1.0) <= FORCE_SHARE
    row["angles_agree"] = max(apart) <= ANGLE_DEG
    keys = ("patch_mm2", "pressure_mean_kpa", "pressure_p99_kpa", "axial_force_n")
    stresses = ("object_tension_p99_kpa", "object_compression_p99_kpa", "object_von_mises_p99_kpa")
    return {**row, **{f"{key}_fea": fea[key] for key in (*keys, *stresses)}}


def _say(row: dict) -> None:
    print(f"  {row['pumped_volume_ml']:7.3f} ml: {row['normal_force_n']:.4f} N", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", nargs="*", choices=CASES, default=list(CASES))
    parser.add_argument("--element-size-mm", type=float, default=3.0)
    parser.add_argument("--wall-n-per-mm", type=float, default=GripperMake().wall_n_per_mm)
    parser.add_argument("--out", type=Path, default=Path("build/grasp_crosscheck"))
    asked = parser.parse_args()
    make = GripperMake(wall_n_per_mm=asked.wall_n_per_mm)
    rows = [row for case in asked.cases for row in compare(case, asked.element_size_mm, asked.out, make)]
    table = Table("case", "ml", "N FE", "N twin", "ratio", "theta1 FE", "twin", "theta2 FE", "twin", "agrees")
    for row in rows:
        numbers = [row[f"theta{k}_{who}_deg"] for k in (1, 2) for who in ("fea", "twin")]
        ratio = "" if row["force_ratio"] is None else f"{row['force_ratio']:.3f}"
        agrees = (
            f"force {'yes' if row['force_agrees'] else 'no'}, angles {'yes' if row['angles_agree'] else 'no'}"
        )
        forces = (f"{row['force_fea_n']:.4f}", f"{row['force_twin_n']:.4f}", ratio)
        table.add_row(
            row["case"],
            f"{row['pumped_volume_ml']:.3f}",
            *forces,
            *(f"{value:.2f}" for value in numbers),
            agrees,
        )
    Console(width=140).print(table)
    print(f"written: {write_table(asked.out / 'crosscheck.csv', rows)}")


if __name__ == "__main__":
    main()
