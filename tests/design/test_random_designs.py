"""A hundred random designs: each is exported watertight, or refused by the rules with the reason."""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

import numpy as np
import pytest
import trimesh

from tubefoot.design.finger import FingerDesign
from tubefoot.design.printability import check_rules
from tubefoot.design.rules import broken
from tubefoot.errors import GeometryError

COUNT = 100
SEED = 20


def random_design(rng: np.random.Generator) -> dict[str, Any]:
    """Settings drawn wider than what can be printed, so that rules have something to refuse."""

    def between(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 3)

    bore = between(0.7, 2.4)
    tube = round(bore + between(1.15, 1.9), 3)
    hose = round(tube / between(1.02, 1.3), 3)
    return {
        "name": "random",
        "bellows": {
            "units": int(rng.integers(1, 13)),
            "fold_run_mm": between(2.5, 8.0),
            "fold_rise_mm": between(0.0, 1.5),
            "crest_flat_mm": between(3.5, 7.0),
            "valley_flat_mm": between(0.6, 2.5),
            "fold_wall_mm": between(0.95, 1.8),
            "valley_wall_mm": between(0.9, 2.5),
            "partition_mm": between(0.9, 3.8),
            "chamber_gap_mm": between(2.0, 5.0),
            "height_mm": between(6.0, 14.0),
            "side_wall_mm": between(0.6, 2.0),
            "cap_mm": between(2.5, 6.0),
            "fillet_outside_mm": float(rng.choice([0.0, between(0.05, 0.5)])),
            "fillet_chamber_mm": float(rng.choice([0.0, between(0.05, 0.5)])),
        },
        "ports": {
            "bore_mm": bore,
            "outer_diameter_mm": tube,
            "hose_bore_mm": hose,
            "hose_outer_mm": round(hose + 1.4, 3),
            "length_mm": between(7.0, 12.0),
        },
        "base": {"socket_depth_mm": between(1.5, 3.5), "plate_mm": between(2.0, 4.0)},
        "registration": {"pin_diameter_mm": float(rng.choice([0.0, between(0.7, 1.4)]))},
    }


@pytest.mark.slow
def test_each_random_design_exports_watertight_or_is_refused_with_the_reason(tmp_path):
    from tubefoot.design.export import export_finger

    rng = np.random.default_rng(SEED)
    seconds, reasons = [], Counter()
    for number in range(COUNT):
        growth = float(rng.choice([0.0, 0.15]))
        try:
            design = FingerDesign.model_validate(random_design(rng))
        except GeometryError as error:
            told = str(error).split("`: ")[1]
            reasons[f"no finger: {told.split(' is ')[0]}" if "must be" in told else "no reason"] += 1
            continue
        if faults := broken(check_rules(design)):
            assert all(rule.advice for rule in faults)
            reasons.update(rule.name for rule in faults[:1])
            continue
        directory = tmp_path / str(number)
        started = time.process_time()
        exported = export_finger(design, directory, growth, pictures=False)
        seconds.append(time.process_time() - started)
        for path in (file for file in exported.files if file.suffix == ".stl"):
            mesh = trimesh.load(path)
            assert mesh.is_watertight, path
            assert mesh.is_winding_consistent, path
            assert mesh.volume > 0, path
        assert exported.summary["wall_error_max_mm"] < 0.03
    assert "no reason" not in reasons
    refused = sum(reasons.values())
    print(f"\n{len(seconds)} exported, {refused} refused, seed {SEED}")
    print(f"export without pictures: median {np.median(seconds):.1f}, longest {max(seconds):.1f} CPU s")
    for reason, count in reasons.most_common():
        print(f"  {count:3d} refused by: {reason}")
    assert len(seconds) + refused == COUNT
    assert len(seconds) >= 30
    assert refused >= 25
