"""The finger in MuJoCo: rigid links with one hinge at the middle of each unit, driven by the reduced law.

MuJoCo integrates the links (gravity, tip load, whatever touches them); the law's moments act on the hinges as
applied torques. Their stiffness K would need microseconds if it acted explicitly: a dashpot of h K on each
hinge, which MuJoCo treats implicitly, makes the torque that at the end of the step of length h, to first
order. That is the linearly implicit Euler method; it damps modes faster than 1 / h. What relaxes faster
than the shortest Prony term is lumped in a dashpot too: loss over storage modulus grows by `FAST_LOSS` of
that term's time, times the angular frequency.

The scene (`finger_body`) is in SI units; in and out go mm, N, MPa, rad. Shear moves the links sideways
(`place_links`): it changes the shape, not the law. Units keep their length; docs/verification.md says what
that costs.
"""

from __future__ import annotations

from math import ceil

import mujoco
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.relaxation import NO_RELAXATION, Prony
from tubefoot.twin.compiled_wall import CompiledWall
from tubefoot.twin.finger_body import METRE, NEWTON_METRE, finger_scene
from tubefoot.twin.finger_body import Mounting as Mounting

FloatArray = NDArray[np.float64]

FAST_LOSS = 0.3
"""Dashpot over the fast stiffness, share of the shortest relaxation time (0.1 s at 20 degC); with it the loss
modulus at 10 Hz and 20 degC is half of the measured one (92 MPa, `design/data/agilus30_dma_20C.csv`)."""
ELASTIC_LOSS_S = 0.03
"""The same for a wall without memory [s]."""
WILD_MOMENT = 1e6
"""Moment of the wall at which a run is stopped as unstable [N mm], far above what any finger bears."""


@njit(cache=True)
def place_links(angles, moments, lengths, shear, places, tip):  # type: ignore[no-untyped-def]
    """Put each link where an arc under shear would end.

    Two halves and a hinge span less than an arc, by phi^2 / 12. The shear force at rest is the slope of the
    moment from hinge to hinge, taken over both neighbours.

    angles : (n,) [rad]; moments : (n,) that the wall bears [N mm]; lengths : half a unit, a cap [m]
    shear : shift over moment difference of neighbours [m/(N mm)]
    places : (n, 3) out, each hinge over the one below [m]; tip : (3,) out, the tip over the last hinge [m]
    """
    last = angles.shape[0] - 1
    below, slipped = lengths[1], 0.0
    for unit in range(last + 1):
        arc = lengths[0] * (1.0 + angles[unit] ** 2 / 12.0)
        lower, upper = max(unit - 1, 0), min(unit + 1, last)
        slip = -0.5 * shear * (moments[lower] - moments[upper]) / max(upper - lower, 1)
        places[unit, 0], places[unit, 2] = slipped + slip, below + arc
        below, slipped = arc, slip
    tip[0], tip[2] = slipped, below + lengths[1]


class FingerChain:
    """The law on the hinges of one finger in a scene: torques before a step, memory after it."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        finger: ReducedFinger,
        prony: Prony = NO_RELAXATION,
        seam: float = 0.0,
        name: str = "finger",
    ):
        """Find the hinges.

        model, data : of the scene; finger : the law; prony : how its wall relaxes
        seam : elastic bending stiffness that the bond adds to each unit, share of the unit's own at rest
        name : the bodies' prefix
        """
        n = finger.n_units
        self.wall = CompiledWall(finger, prony)
        first, place = (
            int(at[0]) for at in (model.joint(f"{name}_0").dofadr, model.joint(f"{name}_0").qposadr)
        )
        self.angles: FloatArray = data.qpos[place : place + n]
        self._torques = data.qfrc_applied[first : first + n]
        self._damping = model.dof_damping[first : first + n]
        self._moments, self._stiffness = np.zeros(n), np.zeros(n)
        self._seam = seam * finger.unit_stiffness
        self._loss = FAST_LOSS * min(prony.times_s, default=ELASTIC_LOSS_S / FAST_LOSS)
        self._option = model.opt
        link = int(model.body(f"{name}_link_0").id)
        self._link_places: FloatArray = model.body_pos[link : link + n]
        self._tip_place: FloatArray = model.site_pos[model.site(f"{name}_tip").id]
        self._lengths = np.array([finger.pitch / 2, finger.cap]) / METRE
        self._shear = finger.shear_compliance / finger.scale / finger.pitch / METRE

    def prepare(self) -> None:
        """Get ready for the next step: once after every step, before volumes are asked for."""
        self.wall.prepare(self.angles, self._option.timestep)
        place_links(
            self.angles, self._moments, self._lengths, self._shear, self._link_places, self._tip_place
        )

    def forget(self) -> None:
        """Begin anew with the present angles, no moments and a relaxed wall."""
        self.wall.settle()
        self._moments[:] = 0.0
        self.prepare()

    def apply(self, right: float, left: float) -> None:
        """Put the law's torques on the hinges for the prepared step.

        right, left : pressures at its end [MPa]

        Raises ConvergenceError when the finger has gone wild.
        """
        self.wall.commit(self.angles, right, left, self._moments, self._stiffness)
        if not abs(float(self._moments @ self._moments)) < WILD_MOMENT**2:
            raise ConvergenceError(
                "the simulated finger became unstable; lower its load, or use a shorter time step"
            )
        if self._seam:
            self._moments += self._seam * self.angles
            self._stiffness += self._seam
        np.multiply(self._moments, -1.0 / NEWTON_METRE, out=self._torques)
        dashpot = (self._option.timestep + self._loss) / NEWTON_METRE
        np.multiply(self._stiffness, dashpot, out=self._damping)


class SimulatedFinger:
    """One finger on its base: chamber pressures in, angles and volumes out.

    tip_force : (x, z) on the middle of the tip face, in the base's frame [N]; may be changed between steps
    """

    def __init__(
        self,
        finger: ReducedFinger,
        prony: Prony = NO_RELAXATION,
        mounting: Mounting | None = None,
        time_step: float = 1e-3,
        seam: float = 0.0,
    ):
        """Build the scene, straight and at rest.

        finger : the law; prony : how its wall relaxes; mounting : its direction against gravity
        time_step : longest step [s]
        seam : elastic bending stiffness that the bond adds to each unit, share of the unit's own at rest
        """
        self.model = mujoco.MjModel.from_xml_string(finger_scene(finger, mounting or Mounting(), time_step))
        self.data = mujoco.MjData(self.model)
        self.chain = FingerChain(self.model, self.data, finger, prony, seam)
        self.tip_force = (0.0, 0.0)
        self._pushed = False
        self._own_scale = finger.scale
        self._time_step = time_step
        self._tip_site = self.model.site("finger_tip").id
        self._tip_link = int(self.model.site_bodyid[self._tip_site])
        mujoco.mj_forward(self.model, self.data)
        self.chain.prepare()

    @property
    def unit_angles(self) -> FloatArray:
        """Angle of each unit, from the base [rad]."""
        return self.chain.angles.copy()

    @property
    def bend(self) -> float:
        """Direction of the tip [rad], positive towards -x."""
        return float(self.chain.angles.sum())

    @property
    def tip(self) -> tuple[float, float]:
        """Place of the middle of the tip face (x, z) [mm]."""
        x, _, z = self.data.site_xpos[self._tip_site]
        return float(x) * METRE, float(z) * METRE

    def volumes(self, right: float, left: float, duration: float) -> tuple[float, float, float, float, float]:
        """Volume changes of the chambers at the present angles [mm^3] and their derivatives.

        right, left : pressures at the end of the step [MPa]; duration : of the step [s]

        The derivatives: right by right, right by left and back, left by left [mm^3/MPa].
        """
        self._divide(duration)
        return self.chain.wall.volumes(right, left)

    def advance(self, right: float, left: float, duration: float) -> None:
        """Move on.

        right, left : chamber pressures, held over the step [MPa]; duration : of the step [s]

        Raises ConvergenceError when the finger becomes unstable.
        """
        for _ in range(self._divide(duration)):
            self.chain.apply(right, left)
            if self.tip_force != (0.0, 0.0) or self._pushed:
                self._push()
            mujoco.mj_step(self.model, self.data)
            self.chain.prepare()

    def scale_stiffness(self, factor: float) -> None:
        """Make the wall stiffer or softer than that of the finger it was built from.

        factor : on every modulus
        """
        self.chain.wall.scale = self._own_scale * factor

    def reset(self) -> None:
        """Straight, at rest, relaxed."""
        mujoco.mj_resetData(self.model, self.data)
        self.chain.forget()
        mujoco.mj_forward(self.model, self.data)

    def _divide(self, duration: float) -> int:
        """Number of steps that make a duration; prepares anew where their length changes."""
        count = max(1, ceil(duration / self._time_step - 1e-9))
        if self.model.opt.timestep != duration / count:
            self.model.opt.timestep = duration / count
            self.chain.prepare()
        return count

    def _push(self) -> None:
        """The tip force, as force and torque about the last link's centre of mass."""
        self._pushed = self.tip_force != (0.0, 0.0)
        force = np.array([self.tip_force[0], 0.0, self.tip_force[1]])
        arm = self.data.site_xpos[self._tip_site] - self.data.xipos[self._tip_link]
        self.data.xfrc_applied[self._tip_link, :3] = force
        self.data.xfrc_applied[self._tip_link, 3:] = np.cross(arm, force)
