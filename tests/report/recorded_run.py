"""A recorded run that no solver made: a one-unit half finger with fields and a curve that are known."""

import json
from pathlib import Path

import meshio
import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.finger_mesh import finger_mesh
from tubefoot.records import Run, write_table

STIFFNESS_KPA_PER_ML = 400.0
GAIN_DEG_PER_KPA = 0.2
N_STATES = 6


def curve_rows(sign: float = 1.0) -> list[dict[str, object]]:
    """Linear in the pumped volume: pressures +-k q, so that work and energy are k q^2."""
    rows = []
    for step, volume in enumerate(sign * np.linspace(0.0, 0.05, N_STATES)):
        pressure = STIFFNESS_KPA_PER_ML * volume
        rows.append(
            {
                "step": step,
                "pumped_volume_ml": float(volume),
                "pressure_right_kpa": float(pressure),
                "pressure_left_kpa": float(-pressure),
                "volume_change_right_ml": float(volume),
                "volume_change_left_ml": float(-volume),
                "bend_deg": float(GAIN_DEG_PER_KPA * pressure),
                "strain_energy_mj": float(STIFFNESS_KPA_PER_ML * volume**2),
                "min_jacobian": 1.0 - 0.01 * step,
                "contact_gap_min_mm": "",
                "contact_gap_where": "right flanks outside, unit 1",
            }
        )
    return rows


def record_run(directory: Path, name: str = "one-unit", sign: float = 1.0) -> Path:
    """A run directory like that of a solve; S13 = y, S33 = x, von Mises = 10 + z [kPa], bent by shearing."""
    design = FingerDesign(name=name).with_bellows(units=1)
    run = Run(directory, "solve", {"design": design.model_dump(), "solve": {"target": 20.0 * sign}})
    rows = curve_rows(sign)
    write_table(run.path("curve.csv"), rows)
    regions = [
        {
            "step": row["step"],
            "region": region,
            "von_mises_p50_kpa": 1.0 * level,
            "von_mises_p95_kpa": 2.0 * level,
            "von_mises_p99_kpa": 3.0 * level,
        }
        for row in rows
        for level, region in enumerate(("all", "fold_right", "partition"), 1)
    ]
    write_table(run.path("regions.csv"), regions)
    mesh = finger_mesh(design.profile, element_size=6.0)
    x, y, z = mesh.points.T
    bent = np.stack([-sign * 0.01 * z**2, 0 * y, 0 * z], axis=1)
    values = {"von_mises_kpa": 10.0 + z, "s13_kpa": y, "s23_kpa": 2.0 * y, "s33_kpa": x}
    run.path("fields").mkdir(exist_ok=True)
    grid = meshio.Mesh(
        mesh.points,
        [(block.kind, block.nodes) for block in mesh.blocks],
        point_data={"displacement_mm": bent, **values},
    )
    grid.write(run.path(f"fields/state_{N_STATES - 1:04d}.vtu"))
    run.path("summary.json").write_text(
        json.dumps({"converged": True, "end_reason": "goal reached", "elements": mesh.n_cells})
    )
    run.finish()
    return directory
