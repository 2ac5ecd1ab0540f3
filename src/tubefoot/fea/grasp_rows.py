"""What is read off a grasp: forces, contact patch and pressure, the object's stress, the two angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.finger_model import HALF
from tubefoot.fea.grasp_model import GraspModel
from tubefoot.fea.grasp_settings import GraspedObject
from tubefoot.fea.ledger import Row
from tubefoot.fea.measures import Stresses, percentile
from tubefoot.fea.solve import SolvedFinger
from tubefoot.fea.step import Step
from tubefoot.units import DEG, KPA, ML

FloatArray = NDArray[np.float64]

TOUCHING_N = 1e-4
"""Normal force from which a grasp touches [N]: what the reach's rim carries is less."""


class GraspedFinger(SolvedFinger):
    """A finger with an object before it, as the recorder reads it."""

    def __init__(self, grasp: GraspModel):
        """Prepare what is read off it.

        grasp : the model that is solved
        """
        super().__init__(grasp.finger)
        self.grasp = grasp
        self.placed = False

    def further_rows(self, number: int, step: Step, stresses: Stresses) -> dict[str, list[Row]]:
        """Rows of seam.csv, hotspots.csv and grasp.csv.

        number : the state's step; step : the state; stresses : of the finger there
        """
        rows = super().further_rows(number, step, stresses)
        return {**rows, "grasp": [grasp_row(self.grasp, number, step, self.placed)]}

    def facts(self) -> dict[str, Any]:
        """What summary.json says of the object."""
        thing = self.grasp.settings.object
        cells = 0 if self.grasp.food is None else len(self.grasp.food.block.nodes)
        return {"object": thing.name, "object_elements": cells, "grasp_middle_x_mm": self.grasp.middle}


def grasp_row(grasp: GraspModel, number: int, step: Step, placed: bool) -> Row:
    """One row of grasp.csv; forces and areas are those of one whole finger.

    grasp : the model; number : the state's step; step : the state; placed : whether the object is in place
    """
    state, finger = step.state, grasp.finger
    bend, middle = finger.tip(state.unknowns)[0], finger.centreline.middle_turn(state.unknowns)
    held, touch = grasp.grip(state), grasp.touch(state)
    on_finger, on_object = grasp.reactions(state)
    patch = touch.patch / HALF
    pressure = held.normal / patch if patch > 0.0 else 0.0
    return {
        "step": number,
        "placed": int(placed),
        "pumped_volume_ml": state.parameter / HALF / ML,
        "pressure_right_kpa": state.pressures[0] / KPA,
        "pressure_left_kpa": state.pressures[1] / KPA,
        "theta1_deg": middle / DEG,
        "theta2_deg": (bend - middle) / DEG,
        **dict(zip(("theta1_chord_deg", "theta2_chord_deg"), chord_turns(grasp, step), strict=True)),
        "normal_force_n": held.normal,
        "axial_force_n": held.axial,
        "contact_height_mm": held.height if held.normal > TOUCHING_N else None,
        "patch_mm2": patch,
        "pressure_mean_kpa": pressure / KPA,
        "pressure_p99_kpa": touch.peak() / KPA,
        "base_force_n": on_finger[0],
        "middle_force_n": on_object[0],
        **_object_stress(grasp, step),
    }


def _object_stress(grasp: GraspModel, step: Step) -> Row:
    """Percentiles by volume of the object's stresses [kPa], and how far its middle plane was shifted [mm]."""
    names = ("tension_p99_kpa", "compression_p99_kpa", "von_mises_p50_kpa", "von_mises_p99_kpa")
    if grasp.food is None:
        return dict.fromkeys([f"object_{name}" for name in names])
    found = Stresses.of(grasp.finger.mesh, grasp.food, step.state)
    smallest = np.asarray(np.linalg.eigvalsh(found.cauchy)[..., 0], np.float64)
    values = (
        percentile(found.max_principal, found.weights, 0.99),
        percentile(-smallest, found.weights, 0.99),
        percentile(found.von_mises, found.weights, 0.50),
        percentile(found.von_mises, found.weights, 0.99),
    )
    return {f"object_{name}": value / KPA for name, value in zip(names, values, strict=True)}


def chord_turns(grasp: GraspModel, step: Step) -> tuple[float, float]:
    """Turns of the chords between midpoints of the markers' lower edges, lower and upper half [deg].

    Five markers, in the middle of both caps and at a quarter, half and three quarters of the bellows, are
    rigid plates that follow the side of the finger. The first turn is from the lowest chord to the one across
    the middle of the finger, the second from there to the uppermost, as in `vision.centreline`.

    grasp : the model; step : the state
    """
    design, mesh = grasp.finger.design, grasp.finger.mesh
    profile, down = design.profile, design.marker_seats.marker_mm / 2
    length = profile.bellows_length
    heights = np.r_[-profile.cap / 2, length * np.array([0.25, 0.5, 0.75]), length + profile.cap / 2]
    side = mesh.facet_set("side").points
    line = side[np.abs(mesh.points[side, 0]) < 1e-9]
    line = line[np.argsort(mesh.points[line, 2])]
    rest = mesh.points[line, 2]
    now = mesh.points[line] + step.state.unknowns[: mesh.points.size].reshape(-1, 3)[line]

    def place(at: FloatArray) -> FloatArray:
        return np.stack([np.interp(at, rest, now[:, axis]) for axis in (0, 2)], axis=1)

    along = place(heights + profile.pitch / 2) - place(heights - profile.pitch / 2)
    edges = place(heights) - down * along / np.linalg.norm(along, axis=1)[:, None]
    crossing = int(np.flatnonzero(heights - down <= length / 2)[-1])
    chords = np.diff(edges, axis=0)
    direction = np.unwrap(np.arctan2(-chords[:, 0], chords[:, 1])) / DEG
    return float(direction[crossing] - direction[0]), float(direction[-1] - direction[crossing])


@dataclass(frozen=True)
class Judgement:
    """Whether an object is known to bear what a grasp does to it.

    margin : smallest bound over value, None where no bound is known or nothing touches; by : which one
    """

    margin: float | None
    by: str | None


def judge(thing: GraspedObject, row: Row) -> Judgement:
    """The smallest ratio of a bound of the object to what it bears in a state.

    thing : with its bounds; row : of grasp.csv
    """
    borne = {
        "compression": (thing.compression_bound_kpa, row["object_compression_p99_kpa"]),
        "tension": (thing.tension_bound_kpa, row["object_tension_p99_kpa"]),
        "pressure": (thing.pressure_bound_kpa, row["pressure_p99_kpa"]),
        "force": (thing.force_bound_n, row["normal_force_n"]),
    }
    margins = {
        name: bound / float(value)
        for name, (bound, value) in borne.items()
        if bound is not None and isinstance(value, float) and value > 1e-9
    }
    if not margins or row["normal_force_n"] <= TOUCHING_N:
        return Judgement(None, None)
    name = min(margins, key=lambda key: margins[key])
    return Judgement(margins[name], name)
