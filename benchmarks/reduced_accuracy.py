"""How far the shipped reduced finger is off: against solves of other lengths, and under tip loads.

python -m benchmarks.reduced_accuracy --units 3 6 12 --loaded 6 12
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.items import State
from tubefoot.fea.solve import solve_design
from tubefoot.reduced.files import reference_finger
from tubefoot.study.loaded_finger import Asked, LoadedFinger, UnitState
from tubefoot.twin.finger import SimulatedFinger
from tubefoot.twin.finger_body import Mounting
from tubefoot.units import DEG, KPA, ML

REFERENCE = Path(__file__).parents[1] / "examples" / "designs" / "reference-12.toml"
ELEMENT_SIZE_MM = 2.0
LOADS = {6: (400.0, (-0.1, 0.1)), 12: (600.0, (-0.04, 0.04, 0.08))}
"""Pumped volume [mm^3] and tip forces [N] by number of units."""
STEPS = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, nargs="*", default=[3, 6, 12])
    parser.add_argument("--loaded", type=int, nargs="*", choices=sorted(LOADS), default=sorted(LOADS))
    given = parser.parse_args()
    design = load_design(REFERENCE)
    for units in given.units:
        free_bending(design.with_bellows(units=units))
    for units in given.loaded:
        tip_loads(design.with_bellows(units=units))


def free_bending(design: FingerDesign) -> None:
    """Largest errors along the pump's way to 35 kPa: at the same volumes, and at the same pressures."""
    finger = reference_finger().with_units(design.bellows.units)
    with tempfile.TemporaryDirectory() as place:
        settings = SolveSettings(fields="none", element_size_mm=ELEMENT_SIZE_MM)
        solved = solve_design(design, Path(place) / "solve", settings)
    pumped, bend = solved.column("pumped_volume_ml") * ML, solved.column("bend_deg")
    pressures = np.stack([solved.column(f"pressure_{hand}_kpa") for hand in ("right", "left")], axis=1)
    by_volume = [finger.equilibrium(np.array([volume, -volume])) for volume in pumped]
    by_pressure = [finger.free_bending(pair * KPA) for pair in pressures]
    off = {
        "bend by volume [deg]": [state.bend / DEG for state in by_volume] - bend,
        "pressures by volume [kPa]": np.array([state.pressures / KPA for state in by_volume]) - pressures,
        "bend by pressure [deg]": [state.bend / DEG for state in by_pressure] - bend,
        "volume by pressure [ml]": np.array([state.volumes / ML for state in by_pressure])
        - np.outer(pumped / ML, [1.0, -1.0]),
    }
    print(f"{design.bellows.units} units to {bend[-1]:.2f} deg, largest errors:")
    for name, values in off.items():
        print(f"  {name}: {np.abs(values).max():.4f}")


def tip_loads(design: FingerDesign) -> None:
    """Turn and move of the tip by a transverse force, chambers closed: finite elements, MuJoCo chain."""
    units = design.bellows.units
    volume, forces = LOADS[units]
    finger = LoadedFinger(design, ELEMENT_SIZE_MM)
    way = [finger.rest()]
    for step in range(1, STEPS + 1):
        asked = _asked(volume * step / STEPS, 0.0)
        way.append(finger.solve(asked, _ahead(way)).state)
    for filled, base in ((0.0, way[0]), (volume, way[-1])):
        free = _measured(finger, _asked(filled, 0.0), base)
        mine = _chain(units, free, 0.0)
        for force in forces:
            loaded = [base]
            for step in range(1, STEPS + 1):
                loaded.append(finger.solve(_asked(filled, force * step / STEPS), _ahead(loaded)).state)
            found = _measured(finger, _asked(filled, force), loaded[-1])
            chain = _chain(units, found, force)
            turn = (found.bend - free.bend, chain.bend - mine.bend)
            move = (_distance(found.tip, free.tip), _distance(chain.tip, mine.tip))
            print(
                f"{units} units, {filled:.0f} mm3, {force:+.2f} N: turn {turn[0] / DEG:.3f} deg, chain "
                f"{100 * (turn[1] / turn[0] - 1):+.1f} %; move {move[0]:.3f} mm, chain "
                f"{100 * (move[1] / move[0] - 1):+.1f} %"
            )


def _asked(volume: float, force: float) -> Asked:
    return Asked((volume, -volume), force=force)


def _ahead(way: Sequence[State]) -> State:
    """The next state of an evenly stepped way."""
    if len(way) == 1:
        return way[-1]
    last, before = way[-1], way[-2]
    return State(2 * last.unknowns - before.unknowns, 2 * last.pressures - before.pressures, 1.0)


def _measured(finger: LoadedFinger, asked: Asked, state: State) -> UnitState:
    return finger.measure(asked, finger.solve(asked, state))


def _chain(units: int, state: UnitState, force: float) -> SimulatedFinger:
    """The chain at rest with the state's volumes closed in and its tip force."""
    law = reference_finger().with_units(units)
    chain = SimulatedFinger(law, mounting=Mounting(gravity=False))
    chain.tip_force = (-force, 0.0)
    pressures = state.pressures.copy()
    for _ in range(12):
        for _ in range(1500):
            chain.advance(float(pressures[0]), float(pressures[1]), 1e-3)
        found = law.respond(chain.unit_angles, pressures)
        softened = found.compliance + (found.coupling / found.stiffness) @ found.coupling.T
        pressures = pressures + 0.8 * np.linalg.solve(softened, state.volumes - found.volumes)
    return chain


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    return float(np.hypot(one[0] - other[0], one[1] - other[1]))


if __name__ == "__main__":
    main()
