"""What the fingers do to the object at one instant, read from the scene's contacts. N, mm."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tubefoot.twin.finger_body import METRE
from tubefoot.twin.gripper_scene import SIDES, crest_ends

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Touch:
    """One finger's contact with the object.

    normal : sum of the normal forces [N]
    force : (3,) resultant on the object [N]
    largest : normal force of the most loaded crest end [N]
    height : of the resultant, weighted by normal force [mm]; nan without contact
    points : number of contact points with a force
    """

    normal: float
    force: FloatArray
    largest: float
    height: float
    points: int


NO_TOUCH = Touch(0.0, np.zeros(3), 0.0, float("nan"), 0)


class TouchReader:
    """Reads the contacts of a scene."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, n_units: tuple[int, int]):
        """Find the crests.

        model, data : of the scene; n_units : of the right and the left finger
        """
        self._data = data
        self._side_of = np.full(model.ngeom, -1)
        for number, (side, count) in enumerate(zip(SIDES, n_units, strict=True)):
            for name in crest_ends(count, side):
                self._side_of[model.geom(name).id] = number
        self._body_of = np.asarray(model.geom_bodyid)

    def read(self) -> tuple[Touch, Touch]:
        """What the right and the left finger do."""
        if self._data.ncon == 0:
            return NO_TOUCH, NO_TOUCH
        contact = self._data.contact
        address = np.asarray(contact.efc_address)
        active = address >= 0
        geoms = np.asarray(contact.geom)[active]
        address, frames = address[active], np.asarray(contact.frame)[active].reshape(-1, 3, 3)
        places = np.asarray(contact.pos)[active]
        first = self._side_of[geoms[:, 0]]
        crest_first = first >= 0
        sides = np.where(crest_first, first, self._side_of[geoms[:, 1]])
        crests = np.where(crest_first, geoms[:, 0], geoms[:, 1])
        rows = np.asarray(self._data.efc_force)[address[:, None] + np.arange(3)]
        forces = np.einsum("ci,cij->cj", rows, frames) * np.where(crest_first, 1.0, -1.0)[:, None]
        right, left = (
            _summed(
                rows[sides == side, 0], forces[sides == side], places[sides == side], crests[sides == side]
            )
            for side in (0, 1)
        )
        return right, left

    def main_crest(self, side: int) -> tuple[int, int, FloatArray] | None:
        """The most loaded contact of a finger: body of the link, body of the object, place [m]; None without.

        side : 0 right, 1 left
        """
        contact = self._data.contact
        best, found = 0.0, None
        for number in range(self._data.ncon):
            address = int(contact.efc_address[number])
            one, two = (int(geom) for geom in contact.geom[number])
            crest, other = (one, two) if self._side_of[one] >= 0 else (two, one)
            if address < 0 or self._side_of[crest] != side:
                continue
            force = float(self._data.efc_force[address])
            if force > best:
                place = np.array(contact.pos[number])
                best, found = force, (int(self._body_of[crest]), int(self._body_of[other]), place)
        return found


def _summed(normals: FloatArray, forces: FloatArray, places: FloatArray, crests: NDArray[np.int64]) -> Touch:
    total = float(normals.sum())
    if total <= 0.0:
        return NO_TOUCH
    by_crest = np.bincount(crests, weights=normals)
    return Touch(
        total,
        forces.sum(axis=0),
        float(by_crest.max()),
        float(normals @ places[:, 2]) / total * METRE,
        int((normals > 0).sum()),
    )
