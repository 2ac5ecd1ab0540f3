"""Random grasps on random benches, and closings without an object: a row each, in a table that is resumed.

Every trial draws two benches of the population (one a finger), an object (tofu or blueberry, pose, size 0.8
to 1.2, stiffness 0.5 to 2 of the record's), its friction (0.2 to 0.8, which the protocol does not know) and
an error of its placement (up to 3 mm along each axis). It is held for 5 s and lifted, not shaken. The whole
host runs: protocol, rigs, the firmware's core, angles with the vision's scatter.

    python -m benchmarks.grasp_population --count 200 --out build/grasps.csv
    python -m benchmarks.grasp_population --free --count 200 --out build/closings.csv
    python -m benchmarks.grasp_population --tell build/grasps.csv build/closings.csv
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tubefoot.cli.grasp_stage import VirtualGrasp, virtual_grasp
from tubefoot.control.damage import damage_of
from tubefoot.control.grasp_loop import GraspLoop
from tubefoot.control.grasp_protocol import GraspProtocol
from tubefoot.control.grasp_settings import GraspSettings, TrialSettings
from tubefoot.errors import TubefootError
from tubefoot.lab.grasp_object import GraspObject, Pose, known_object
from tubefoot.lab.settings import BoardSettings, RigSettings
from tubefoot.reduced.files import reference_file
from tubefoot.twin.gripper_hands import SimulatedHands
from tubefoot.twin.gripper_scene import GripperMake
from tubefoot.twin.population import TUNING_SEEDS, VERDICT_SEEDS, drawn_bench

STREAM = 90_210
RIG = RigSettings(board=BoardSettings(sample_rate_hz=50))
"""Fewer samples a second than by default: the trials are many, and pauses are judged by means."""
SLIP_MM = 1.0
"""A held object may slip by so much (the issue's bound)."""
FIRM_FRICTION = 0.4
"""Friction from which on nearly all grasps must hold; the grip relies on it."""
COLUMNS = (
    *("trial", "kind", "object", "pose", "size", "stiffness", "friction"),
    *("error_x_mm", "error_y_mm", "error_z_mm", "wall_right", "wall_left"),
    *("held", "slip_mm", "success", "peak_force_n", "damage_margin", "local_margin", "goal_n", "estimate_n"),
    *("latency_right", "latency_left", "false_contacts"),
    *("pulses_outward", "pulses_inward", "pulses_after_contact", "theta1_deg", "theta2_deg"),
    *("bench_time_s", "cpu_s", "end_reason"),
)


@dataclass(frozen=True)
class Draw:
    """What one trial draws."""

    what: GraspObject
    pose: Pose
    size: float
    stiffness: float
    virtual: VirtualGrasp


def drawn(trial: int, free: bool, tuning: bool = False) -> Draw:
    """The draw of a trial; the same for ever.

    trial : its number; free : without an object; tuning : of the benches for tuning
    """
    chance = np.random.default_rng([STREAM, trial, int(tuning)])
    what = known_object(("tofu", "blueberry")[int(chance.integers(2))])
    pose: Pose = ("front", "side")[int(chance.integers(2))]
    size, friction = float(chance.uniform(0.8, 1.2)), float(chance.uniform(0.2, 0.8))
    stiffness = float(np.exp(chance.uniform(math.log(0.5), math.log(2.0))))
    x, y, z = (float(value) for value in chance.uniform(-3.0, 3.0, 3))
    wide, deep, high = what.size_mm
    changed: dict[str, Any] = {
        "size_mm": (size * wide, size * deep, size * high),
        "modulus_kpa": stiffness * what.modulus_kpa,
    }
    if what.firmness_n_per_mm is not None:
        changed["firmness_n_per_mm"] = stiffness * what.firmness_n_per_mm
    seeds = TUNING_SEEDS if tuning else VERDICT_SEEDS
    benches = tuple(drawn_bench(seeds[(2 * trial + side) % len(seeds)]) for side in (0, 1))
    virtual = VirtualGrasp(
        (benches[0], benches[1]), GripperMake(), friction, (x, y, z), seed=trial, quick=True, empty=free
    )
    return Draw(what.model_copy(update=changed), pose, size, stiffness, virtual)


def run_trial(trial: int, free: bool = False, tuning: bool = False) -> dict[str, Any]:
    """One row of the table.

    trial : its number; free : without an object; tuning : of the benches for tuning
    """
    draw = drawn(trial, free, tuning)
    content, settings = reference_file(), GraspSettings(test=TrialSettings(shake_s=0.0))
    finger, memory = content.to_finger(), content.to_prony()
    protocol = GraspProtocol(draw.what, draw.pose, finger, settings, memory=memory)
    began = time.process_time()
    row = _drawn_columns(trial, free, draw) | {"goal_n": protocol.goal.force}
    try:
        with virtual_grasp(draw.what, draw.pose, settings, RIG, draw.virtual) as stage:
            hands = stage.hands
            assert isinstance(hands, SimulatedHands)
            loop = GraspLoop(
                stage.rigs,
                stage.angles,
                hands,
                _UntilSetDown(protocol),
                lambda: {"slip_mm": hands.slip.now()},
            )
            loop.run(protocol)
            verdict = stage.verdict()
    except TubefootError as error:
        return row | {"held": 0, "success": 0, "end_reason": f"{type(error).__name__}: {error}"[:200]}
    return row | _outcome_columns(draw, protocol, loop, verdict, time.process_time() - began)


class _UntilSetDown:
    """Ends a trial when all that counts is known: the object is about to be set down."""

    def __init__(self, protocol: GraspProtocol):
        self._protocol = protocol

    def __call__(self, row: dict[str, Any]) -> None:
        if row["command"] == "lower":
            self._protocol.give_up("complete")


def _drawn_columns(trial: int, free: bool, draw: Draw) -> dict[str, Any]:
    x, y, z = draw.virtual.error
    right, left = draw.virtual.benches
    return {
        "trial": trial,
        "kind": "free" if free else "grasp",
        "object": draw.what.name,
        "pose": draw.pose,
        "size": draw.size,
        "stiffness": draw.stiffness,
        "friction": draw.virtual.friction,
        "error_x_mm": x,
        "error_y_mm": y,
        "error_z_mm": z,
        "wall_right": right.finger.stiffness,
        "wall_left": left.finger.stiffness,
    }


def _outcome_columns(
    draw: Draw, protocol: GraspProtocol, loop: GraspLoop, verdict: dict[str, Any], cpu_s: float
) -> dict[str, Any]:
    outcome = protocol.outcome
    latencies = loop.latencies(protocol, verdict["first_touch_s"])
    damage = damage_of(draw.what, draw.pose, verdict["peak_force_n"], verdict["peak_crest_force_n"])
    held = [row for row in loop.rows if row["phase"] == "hold"][-30:]
    angles = {
        f"{name}_deg": float(
            np.mean([row[f"{name}_{side}_deg"] for row in held for side in ("right", "left")])
        )
        if held
        else math.nan
        for name in ("theta1", "theta2")
    }
    return {
        "held": int(verdict["held"]),
        "slip_mm": verdict["slip_mm"],
        "success": int(verdict["held"] and verdict["slip_mm"] <= SLIP_MM),
        "peak_force_n": verdict["peak_force_n"],
        "damage_margin": damage.margin,
        "local_margin": damage.local_margin,
        "estimate_n": min(outcome.grip_force),
        "latency_right": latencies[0],
        "latency_left": latencies[1],
        "false_contacts": sum(latency == -1 for latency in latencies),
        "pulses_outward": outcome.outward_pulses,
        "pulses_inward": outcome.inward_pulses,
        "pulses_after_contact": outcome.grip_pulses,
        **angles,
        "bench_time_s": loop.rows[-1]["time_s"] if loop.rows else math.nan,
        "cpu_s": cpu_s,
        "end_reason": outcome.reason[:200],
    }


def wilson(hits: int, count: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's interval of a share, 95 % by default.

    hits : of count; z : standard deviations
    """
    if count == 0:
        return 0.0, 1.0
    share, weight = hits / count, z * z / count
    middle = (share + weight / 2) / (1 + weight)
    half = z / (1 + weight) * math.sqrt(share * (1 - share) / count + weight / (4 * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def tell(rows: Sequence[dict[str, str]]) -> list[str]:
    """What a table says, a sentence a line.

    rows : as read from the file
    """
    grasps = [row for row in rows if row["kind"] == "grasp"]
    free = [row for row in rows if row["kind"] == "free"]
    lines = []
    if grasps:
        firm = [row for row in grasps if float(row["friction"]) >= FIRM_FRICTION]
        soft = [row for row in grasps if row["object"] == "tofu"]
        slippery = [row for row in grasps if float(row["friction"]) < FIRM_FRICTION]
        lines += [
            _share("held without slip, friction >= 0.4", [row["success"] == "1" for row in firm]),
            _share("held without slip, friction < 0.4", [row["success"] == "1" for row in slippery]),
            _share("dropped, friction >= 0.4", [row["held"] != "1" for row in firm]),
            _share(
                "beyond a damage bound, friction >= 0.4", [_number(row["damage_margin"]) < 1 for row in firm]
            ),
            _share("beyond a damage bound, all", [_number(row["damage_margin"]) < 1 for row in grasps]),
            _share(
                "tofu, known stress exceeded under a crest",
                [_number(row["local_margin"]) < 1 for row in soft],
            ),
        ]
        latencies = [int(row[key]) for row in grasps for key in ("latency_right", "latency_left") if row[key]]
        lines.append(_share("contact found within one pulse", [0 <= latency <= 1 for latency in latencies]))
        lines.append(_share("contact reported before any touch", [latency < 0 for latency in latencies]))
        speed = sum(_number(row["bench_time_s"]) for row in grasps if row["cpu_s"])
        speed /= sum(_number(row["cpu_s"]) for row in grasps if row["cpu_s"])
        lines.append(f"whole host and bench: {speed:.1f} x real time (CPU)")
        lines += [
            f"  trial {row['trial']}: {row['object']} {row['pose']}, friction "
            f"{float(row['friction']):.2f}, walls "
            f"{float(row['wall_right']):.2f}/{float(row['wall_left']):.2f}, held {row['held']}, slip "
            f"{row['slip_mm'][:5]} mm: "
            f"{row['end_reason']}"
            for row in firm
            if row["success"] != "1"
        ]
    if free:
        lines.append(
            _share(
                "free closings with a false contact", [int(row["false_contacts"] or 0) > 0 for row in free]
            )
        )
        ended = [
            row for row in free if "no contact" not in row["end_reason"] and row["false_contacts"] == "0"
        ]
        lines += [f"  free closing {row['trial']} ended otherwise: {row['end_reason']}" for row in ended]
    return lines


def _share(what: str, hits: Iterable[bool]) -> str:
    found = list(hits)
    low, high = wilson(sum(found), len(found))
    share = sum(found) / len(found) if found else math.nan
    within = f"95 %: {100 * low:.1f} to {100 * high:.1f} %"
    return f"{what}: {sum(found)} of {len(found)} = {100 * share:.1f} % ({within})"


def _number(text: str) -> float:
    return float(text) if text else math.nan


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a table; none where there is no file.

    path : CSV
    """
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def main() -> None:
    """Run the trials that a table lacks, or tell what tables say."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--free", action="store_true", help="closings without an object")
    parser.add_argument("--tuning", action="store_true", help="benches for tuning instead of the verdict's")
    parser.add_argument("--out", type=Path, default=Path("build/grasps.csv"))
    parser.add_argument("--tell", type=Path, nargs="+")
    given = parser.parse_args()
    if given.tell:
        print("\n".join(tell([row for path in given.tell for row in read(path)])))
        return
    done = {int(row["trial"]) for row in read(given.out)}
    given.out.parent.mkdir(parents=True, exist_ok=True)
    with given.out.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if not done:
            writer.writeheader()
        for trial in range(given.first, given.first + given.count):
            if trial in done:
                continue
            row = run_trial(trial, given.free, given.tuning)
            writer.writerow({key: _cell(row.get(key)) for key in COLUMNS})
            file.flush()
            print(
                f"{trial:4d} {row['object']:9s} {row['pose']:5s} success {row['success']} "
                f"{row['end_reason']}",
                flush=True,
            )
    print("\n".join(tell(read(given.out))))


def _cell(value: Any) -> Any:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.6g}" if isinstance(value, float) else value


if __name__ == "__main__":
    main()
