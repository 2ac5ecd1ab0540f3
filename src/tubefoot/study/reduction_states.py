"""The states of a plan, solved one by one and kept on disk, so that an interrupted run goes on."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot import __version__
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError, ConvergenceError
from tubefoot.fea.items import State
from tubefoot.fea.step import StepFailed
from tubefoot.records import write_json, write_whole
from tubefoot.study.loaded_finger import Asked, LoadedFinger, UnitState
from tubefoot.study.reduction_plan import Branch, Reach
from tubefoot.units import ML

FloatArray = NDArray[np.float64]


MOST_SECANTS = 14
"""Until the pump's reach is found."""
PROBE_COUPLE = 0.2
"""With which the resting finger's stiffness is found [N mm]."""


@dataclass(frozen=True)
class SolvedState:
    """One solved state of a branch: what was asked, what came out, whether it is held out."""

    branch: str
    step: int
    check: bool
    asked: Asked
    found: UnitState


@dataclass
class Sampling:
    """All solved states, and the branches that ended early with the reason."""

    reach: Reach
    states: list[SolvedState]
    ended: dict[str, str]


@dataclass(frozen=True)
class Station:
    """A state on a way: its shares (4,), the state to start from, what was measured (None at rest)."""

    shares: FloatArray
    state: State
    found: UnitState | None


Progress = Callable[[SolvedState], None]


class StateStore:
    """Solved states on disk, one file each; the key says to which design and settings they belong."""

    def __init__(self, directory: Path, record: dict[str, object]):
        """Open or begin a store.

        directory : where it lies; record : all that the states depend on

        Raises ConfigError when the directory holds the states of another design or other settings.
        """
        self.directory = directory
        text = json.dumps([__version__, record], sort_keys=True, default=str)
        self.key = hashlib.sha256(text.encode()).hexdigest()
        marker = directory / "key.json"
        if marker.exists() and json.loads(marker.read_text())["key"] != self.key:
            raise ConfigError(
                f"{directory} holds the states of another design or of other settings; "
                "choose another --out, or add --overwrite"
            )
        write_json(marker, {"key": self.key})

    @staticmethod
    def clear(directory: Path) -> None:
        """Drop all states.

        directory : of a store; nothing happens where there is none
        """
        for path in directory.glob("*.npz"):
            path.unlink()
        (directory / "key.json").unlink(missing_ok=True)

    def save(self, name: str, unknowns: FloatArray, found: UnitState) -> None:
        """Put a state on disk.

        name : of the state; unknowns : of the model; found : what was measured
        """
        buffer = io.BytesIO()
        np.savez(buffer, unknowns=unknowns, **{f"found_{key}": value for key, value in asdict(found).items()})
        write_whole(self.directory / f"{name}.npz", buffer.getvalue())

    def load(self, name: str) -> tuple[FloatArray, UnitState] | None:
        """Unknowns and measurements of a state, None where it is not on disk.

        name : of the state
        """
        path = self.directory / f"{name}.npz"
        if not path.exists():
            return None
        data = dict(np.load(path))
        found = {key.removeprefix("found_"): value for key, value in data.items() if key != "unknowns"}
        for key in ("energy", "bend", "gap"):
            found[key] = float(found[key])
        found["tip"] = tuple(float(value) for value in found["tip"])
        return data["unknowns"], UnitState(**found)


class Sampler:
    """Solves the plan's branches, or reads what an interrupted run left of them."""

    def __init__(
        self,
        design: FingerDesign,
        element_size_mm: float,
        store: StateStore,
        progress: Progress | None = None,
    ):
        """Build the finger.

        design : the finger to load; element_size_mm : longest edge of a cell
        store : where solved states are kept; progress : called with each state
        """
        self.finger = LoadedFinger(design, element_size_mm)
        self.store = store
        self.progress = progress
        self._ways: dict[str, list[Station]] = {}

    def run(self, plan: tuple[Branch, ...], pressure: float) -> Sampling:
        """All states of a plan.

        plan : the branches, each after the one that it starts from
        pressure : of the right chamber at the pump's reach [MPa]

        Raises ConvergenceError when the finger cannot even be pumped a little.
        """
        reach = self._find_reach(pressure)
        sampling = Sampling(reach, [], {})
        for branch in plan:
            if (reason := self._walk(branch, reach, sampling)) is not None:
                sampling.ended[branch.name] = reason
        return sampling

    def _walk(self, branch: Branch, reach: Reach, sampling: Sampling) -> str | None:
        """Solve one branch; the reason why it ended early, if it did."""
        start = self._start(branch)
        if isinstance(start, str):
            return start
        way = self._ways[branch.name] = [start]
        end = np.asarray(branch.end)
        for number in range(1, branch.steps + 1):
            shares = start.shares + (end - start.shares) * number / branch.steps
            asked = reach.asked(shares)
            try:
                state, found = self._solved(f"{branch.name}-{number:02d}", asked, way)
            except StepFailed as failure:
                return f"no state beyond step {number - 1} of {branch.steps}: {failure}"
            if found.gap <= 0.0:
                return f"walls touch beyond step {number - 1} of {branch.steps}"
            way.append(Station(shares, state, found))
            solved = SolvedState(branch.name, number, branch.check, asked, found)
            sampling.states.append(solved)
            if self.progress is not None:
                self.progress(solved)
        return None

    def _start(self, branch: Branch) -> Station | str:
        """Where a branch leaves from, or why it cannot."""
        if branch.start is None:
            return Station(np.zeros(4), self.finger.rest(), None)
        name, number = branch.start
        way = self._ways.get(name, [])
        return way[number] if number < len(way) else f"the branch `{name}` ended before its state {number}"

    def _solved(self, name: str, asked: Asked, way: list[Station]) -> tuple[State, UnitState]:
        if (known := self.store.load(name)) is not None:
            unknowns, found = known
            return State(unknowns, found.pressures, 1.0), found
        try:
            step = self.finger.solve(asked, _extrapolated([station.state for station in way]))
        except StepFailed:
            step = self.finger.solve(asked, way[-1].state)
        found = self.finger.measure(asked, step)
        self.store.save(name, step.state.unknowns, found)
        return step.state, found

    def _find_reach(self, pressure: float) -> Reach:
        """Pumped volume at which the right chamber has a pressure, by secants from rest; couple and force."""
        rest_volume = float(self.finger.rest_volumes[0])
        volume, reached, bend = 0.02 * rest_volume, 0.0, 0.0
        way = [Station(np.zeros(4), self.finger.rest(), None)]
        for number in range(MOST_SECANTS):
            try:
                state, found = self._solved(f"reach-{number:02d}", Asked((volume, -volume)), way)
            except StepFailed as failure:
                if number == 0:
                    raise ConvergenceError(
                        f"the finger cannot be pumped by {volume / ML:.3g} ml: {failure}"
                    ) from failure
                break
            if found.gap <= 0.0:
                break
            way.append(Station(np.zeros(4), state, found))
            reached, bend = volume, found.bend
            here = float(found.pressures[0])
            if here >= 0.99 * pressure:
                break
            volume = min(volume * pressure / here, 2.5 * volume, volume + 0.2 * rest_volume)
        couple = self._couple_stiffness() * bend
        return Reach(reached, couple, 2.0 * couple / self.finger.profile.bellows_length)

    def _couple_stiffness(self) -> float:
        """Couple over bend of the resting finger, chambers closed [N mm/rad]."""
        probe = Asked((0.0, 0.0), couple=PROBE_COUPLE)
        _, found = self._solved("probe-couple", probe, [Station(np.zeros(4), self.finger.rest(), None)])
        return probe.couple / found.bend


def _extrapolated(states: list[State]) -> State:
    """The next state of an evenly stepped way, from its last three."""
    if len(states) == 1:
        return states[-1]
    recent = states[-3:]
    weights = (-1.0, 2.0) if len(recent) == 2 else (1.0, -3.0, 3.0)
    unknowns = sum((w * s.unknowns for w, s in zip(weights, recent, strict=True)), np.zeros(1))
    pressures = sum((w * s.pressures for w, s in zip(weights, recent, strict=True)), np.zeros(2))
    return State(unknowns, pressures, 1.0)
