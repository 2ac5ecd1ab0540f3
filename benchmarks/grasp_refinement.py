"""How force and patch of a grasp depend on the mesh: a three-unit finger on a soft box and on a ball.

`python -m benchmarks.grasp_refinement [--sizes-mm 4 3 2] [--out DIR]`. Both bodies are refined together.
"""

import argparse
from pathlib import Path

from tubefoot.design.finger import load_design
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.grasp_settings import GraspedObject, GraspSettings
from tubefoot.fea.grasp_solve import solve_grasp
from tubefoot.records import read_table, write_table

DESIGN = Path("examples/designs/reference-3.toml")
OBJECTS = {
    "tofu box": GraspedObject(sizes_mm=(9.0, 9.0, 10.0)),
    "blueberry": GraspedObject(
        shape="ellipsoid", sizes_mm=(9.0, 9.0, 9.0), youngs_modulus_kpa=800.0, poisson_ratio=0.45
    ),
}
COLUMNS = ("normal_force_n", "patch_mm2", "pressure_mean_kpa", "pressure_p99_kpa", "theta1_deg", "theta2_deg")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes-mm", type=float, nargs="+", default=[4.0, 3.0, 2.0])
    parser.add_argument("--out", type=Path, default=Path("build/grasp_refinement"))
    asked = parser.parse_args()
    rows = []
    for name, thing in OBJECTS.items():
        for size in asked.sizes_mm:
            grasp = GraspSettings(
                object=thing,
                finger_gap_mm=9.0,
                height_mm=18.5,
                open_ml=-0.2,
                states_ml=(0.0, 0.1),
                object_element_mm=size,
            )
            settings = SolveSettings(element_size_mm=size, self_contact=False, fields="none")
            directory = asked.out / f"{name.replace(' ', '-')}-{size:g}mm"
            solve_grasp(load_design(DESIGN), directory, grasp, settings)
            for found in read_table(directory / "grasp.csv"):
                if found["placed"] and found["pumped_volume_ml"] in grasp.states_ml:
                    numbers = {key: found[key] for key in COLUMNS}
                    volume = found["pumped_volume_ml"]
                    rows.append(
                        {"object": name, "element_size_mm": size, "pumped_volume_ml": volume, **numbers}
                    )
                    print(", ".join(f"{key} {value}" for key, value in rows[-1].items()), flush=True)
    print(f"written: {write_table(asked.out / 'refinement.csv', rows)}")


if __name__ == "__main__":
    main()
