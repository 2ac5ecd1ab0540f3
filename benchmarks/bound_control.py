"""The least time to a hold that a fully known bench allows, with any number of pulses: a linear programme.

`python -m benchmarks.bound_control` takes every tenth bench of the verdict (some minutes), `--every 1` all of
them; beside each least time stands half the time of the paper's controller there. The model is the
controller's own (`control/bench_model.py`) with the numbers of the drawn bench: nothing to learn, no latency,
no scatter, and a pump that follows any flow up to its full one but for its lag. Flows of tenths of a second
are free until the hold; in it the pump stands. Asked for is the least mean error in the hold, with overshoot,
band and pressures bounded. About a path all of these are linear in the flows, so near it what the programme
does not find does not exist; the path is found by repeating it, and what it promises is checked with the
model. That no path far from it would be sooner is not proved.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from benchmarks.bench_control import TABLE, TARGET_DEG
from tubefoot.control import bench_model as rows
from tubefoot.control.bench_model import BenchModel
from tubefoot.records import read_table
from tubefoot.reduced.files import reference_file
from tubefoot.reduced.relaxation import DECADES_PER_K
from tubefoot.twin.population import VERDICT_SEEDS, drawn_bench
from tubefoot.units import DEG, KPA, ML

FloatArray = NDArray[np.float64]

HOLD_S, MEAN_DEG, BAND_DEG, OVERSHOOT_DEG, LIMIT_KPA = 2.0, 0.3, 1.0, 1.0, 86.0
"""What is asked of the controllers, and where the guard stops the pump."""
STEP_S, KNOT = 0.05, 2
"""Step of the model, and how many of them have one flow."""
SHORTEST, LONGEST = 4, 120
"""Knots before the hold."""
REPEATS, NUDGE = 3, 0.08
"""How often a path is improved, and the share of the full flow by which it is varied."""
CLOSE_DEG = 0.01
"""By which a plan may miss the mean error."""
OF_BAND, OF_OVERSHOOT, OF_PRESSURE = 50.0, 50.0, 5.0
"""What a miss costs beside the mean error, by degree and kilopascal."""


@dataclass(frozen=True)
class Plan:
    """Flows of the knots [mm^3/s], mean error in the hold that they give, with what is missed [deg]."""

    flows: FloatArray
    mean: float


class Question:
    """A target from a state of a known bench."""

    def __init__(self, model: BenchModel, start: FloatArray, full: FloatArray, target_deg: float):
        self.model, self.start, self.full, self.target = model, start, full, target_deg
        self.way = 1.0 if target_deg > float(model.bend(start)[0]) / DEG else -1.0

    def least(self) -> tuple[float, Plan] | None:
        """Time from the start to the end of the hold [s], and its plan: by bisection."""
        low, high, found = SHORTEST, LONGEST, None
        while low <= high:
            count = (low + high) // 2
            plan = self.best(count, found[1].flows if found else None)
            if plan.mean <= MEAN_DEG + CLOSE_DEG:
                found, high = (count * KNOT * STEP_S + HOLD_S, plan), count - 1
            else:
                low = count + 1
        return found

    def best(self, count: int, guess: FloatArray | None = None) -> Plan:
        """The plan with the least mean error in a hold after so many knots."""
        flows = np.zeros(count)
        if guess is None:
            flows[: min(count, 12)] = 0.6 * self.way * self.full.mean()
        else:
            flows = np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(guess)), guess)
        plans = []
        for _ in range(REPEATS):
            flows = self._improved(flows)
            plans.append(Plan(flows, self._missed(flows)))
            if plans[-1].mean <= MEAN_DEG + CLOSE_DEG:
                break
        return min(plans, key=lambda plan: plan.mean)

    def paths(self, flows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angles past the target [deg], pressures [kPa] (steps, 2, n), end states; flows : (knots, n)."""
        sent = np.repeat(flows, KNOT, axis=0) * STEP_S
        sent = np.vstack([sent, np.zeros((round(HOLD_S / STEP_S), flows.shape[1]))])
        state, bends, pressures = np.repeat(self.start, flows.shape[1], axis=1), [], []
        for volumes in sent:
            state = self.model.step(state, STEP_S, volumes)
            bends.append(self.way * (self.model.bend(state) / DEG - self.target))
            pressures.append(self.model.branch_pressures(state) / KPA)
        return np.array(bends), np.array(pressures), state

    def _improved(self, flows: FloatArray) -> FloatArray:
        """Solve the programme about the path of some flows."""
        count, nudge = len(flows), -self.way * NUDGE * self.full.mean()
        bends, pressures, _ = self.paths(np.column_stack([flows, flows[:, None] + nudge * np.eye(count)]))
        slope, steep = (
            (bends[:, 1:] - bends[:, :1]) / nudge,
            (pressures[..., 1:] - pressures[..., :1]) / nudge,
        )
        base, load = bends[:, 0] - slope @ flows, pressures[..., 0] - steep @ flows
        begin = count * KNOT - 1
        held = len(bends) - begin
        none = np.zeros((held, held))
        parts = [
            (slope[begin:], -np.eye(held), (0, 0, 0), -base[begin:]),
            (-slope[begin:], -np.eye(held), (0, 0, 0), base[begin:]),
            (np.zeros((held, count)), np.eye(held), (-1, 0, 0), np.full(held, BAND_DEG)),
            (slope, np.zeros((len(bends), held)), (0, -1, 0), OVERSHOOT_DEG - base),
        ]
        for side in (0, 1):
            for sign in (1.0, -1.0):
                room = LIMIT_KPA - sign * load[: begin + 1, side]
                parts.append(
                    (sign * steep[: begin + 1, side], none[:1].repeat(begin + 1, 0), (0, 0, -1), room)
                )
        table = np.vstack(
            [
                np.hstack([by_flow, by_error, np.tile(slack, (len(right), 1))])
                for by_flow, by_error, slack, right in parts
            ]
        )
        price = np.concatenate(
            [np.zeros(count), np.full(held, 1.0 / held), [OF_BAND, OF_OVERSHOOT, OF_PRESSURE]]
        )
        bounds = [(-self.full[1], self.full[0])] * count + [(0.0, None)] * (held + 3)
        found = linprog(price, table, np.concatenate([part[3] for part in parts]), bounds=bounds)
        return np.asarray(found.x[:count])

    def _missed(self, flows: FloatArray) -> float:
        """Mean error in the hold, and what is missed beside it, as the model has it [deg]."""
        bends, pressures, _ = self.paths(flows[:, None])
        begin = len(flows) * KNOT - 1
        away = np.abs(bends[begin:, 0])
        missed = max(0.0, away.max() - BAND_DEG) + max(0.0, bends.max() - OVERSHOOT_DEG)
        return float(
            away.mean() + missed + 0.05 * max(0.0, np.abs(pressures[: begin + 1]).max() - LIMIT_KPA - 1.0)
        )


def known(seed: int, model: BenchModel) -> tuple[FloatArray, FloatArray]:
    """A drawn bench at rest as the model has it, and its flows at full duty, forward and reverse [mm^3/s]."""
    make = drawn_bench(seed)
    branches, finger, pump, warm = make.branches, make.finger, make.pump, make.climate.start_k
    guess = np.zeros((rows.UNKNOWN, 1))
    guess[rows.STIFFNESS] = np.log(finger.stiffness * (1.0 + make.climate.stiffness_per_k * warm))
    guess[rows.SPRING] = finger.seam_stiffening
    guess[rows.GAS_RIGHT] = np.log(ML * (branches.air_right_ml + finger.bubble_right_ml))
    guess[rows.GAS_LEFT] = np.log(ML * (branches.air_left_ml + finger.bubble_left_ml))
    guess[rows.TUBE] = np.log(branches.tube_kpa_s_per_ml * KPA / ML)
    guess[rows.LAG] = np.log(pump.lag_s)
    guess[rows.LEAK] = np.log(1e-9)  # a tight pump
    guess[rows.PACE] = -np.log(10.0) * DECADES_PER_K * warm
    full = np.array([pump.flow_forward_ml_per_s, pump.flow_reverse_ml_per_s]) * ML * (1.0 - pump.wear)
    return model.at_rest(guess), full


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--every", type=int, default=10, help="1: all benches, 10: every tenth")
    reference = reference_file()
    model = BenchModel(reference.to_finger(), reference.to_prony())
    times = {(row["seed"], row["controller"], row["part"]): row["bench_time_s"] for row in read_table(TABLE)}
    found: dict[str, list[tuple[float, float]]] = {"to": [], "return": []}
    for seed in VERDICT_SEEDS[:: parser.parse_args().every]:
        state, full = known(seed, model)
        for part, target in (("to", TARGET_DEG), ("return", 0.0)):
            question = Question(model, state, full, target)
            answer = question.least()
            if answer is None:
                print(seed, part, f"no plan within {LONGEST * KNOT * STEP_S + HOLD_S:g} s", flush=True)
                break
            half, mine = 0.5 * times[seed, "paper", part], times[seed, "adaptive", part]
            state = question.paths(answer[1].flows[:, None])[2]
            found[part].append((answer[0], half))
            print(
                f"{seed} {part}: {answer[0]:.1f} s; half of the paper's {half:.1f}; ours {mine:.1f}",
                flush=True,
            )
    for part, pairs in found.items():
        least, half = np.array(pairs).T
        print(
            f"{part}: median {np.median(least):.2f} s, half of the paper's median {np.median(half):.2f} s; "
            f"half attainable in {int((least <= half).sum())} of {len(least)}"
        )


if __name__ == "__main__":
    main()
