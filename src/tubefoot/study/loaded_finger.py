"""A finger with prescribed chamber volumes and a loaded tip, for identifying the reduced model.

Each state is asked for by four numbers: the two volumes pumped in, a couple and a transverse force on the tip
face. Both loads are dead (they keep their direction), so the moment at any section follows from statics:
M = sum over the loaded nodes of (x - c_x) f_z - (z - c_z) f_x, positive where it bends towards -x.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.finger import FingerDesign
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.elements import element_kind
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger
from tubefoot.fea.finger_model import HALF, SolveSettings, build_finger, contact_walls
from tubefoot.fea.items import State
from tubefoot.fea.measures import SectionRotation
from tubefoot.fea.mesh import FacetSet, Mesh
from tubefoot.fea.step import Step
from tubefoot.fea.traction import Traction

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Asked:
    """What a state is asked to have, whole finger.

    volumes : pumped into the right and the left chamber [mm^3]
    couple : on the tip face, at its undeformed direction [N mm], positive bends towards -x
    force : transverse force on the tip [N], positive pushes towards -x
    """

    volumes: tuple[float, float]
    couple: float = 0.0
    force: float = 0.0


@dataclass(frozen=True)
class UnitState:
    """What a solved state says about each unit, whole finger; unit 0 at the base, the caps with their units.

    angles : (n,) turn of each unit [rad]; moments : (n,) at the units' middle [N mm]
    shears : (n,) section force across the unit, towards -x positive [N]
    slips : (n,) shift of its upper end towards -x, against rigid halves with a hinge between them [mm]
    pressures : (2,) [MPa]; volumes : (2,) changes [mm^3]; energy : strain energy [mJ]
    bend : turn of the tip face [rad]; tip : (x, z) of its middle [mm]; gap : smallest between walls [mm]
    """

    angles: FloatArray
    moments: FloatArray
    shears: FloatArray
    slips: FloatArray
    pressures: FloatArray
    volumes: FloatArray
    energy: float
    bend: float
    tip: tuple[float, float]
    gap: float


class LoadedFinger:
    """A finger model that can be asked for any state of filling and tip load."""

    def __init__(self, design: FingerDesign, element_size_mm: float):
        """Mesh the half finger and put the loads on its tip face.

        design : the finger; element_size_mm : longest edge of a cell
        """
        built = build_finger(design, SolveSettings(element_size_mm=element_size_mm))
        self.profile = design.profile
        self.mesh = _with_tip_halves(built.mesh)
        self._areas = {name: _nodal_areas(self.mesh, name) for name in ("tip", "tip_right", "tip_left")}
        area = {name: float(shares.sum()) for name, (_, shares) in self._areas.items()}
        arms = self._areas["tip_right"][1] @ self.mesh.points[self._areas["tip_right"][0], 0]
        self._couple_arm = 2.0 * float(arms) / area["tip_right"]
        self._couple = [
            Traction(self.mesh, name, (0.0, 0.0, sign / area[name]), 0.0)
            for name, sign in (("tip_right", 1.0), ("tip_left", -1.0))
        ]
        self._force = Traction(self.mesh, "tip", (-1.0 / area["tip"], 0.0, 0.0), 0.0)
        old = built.model
        extra = old.items[len(old.solids) + len(old.cavities) :]
        self.model = Model(
            self.mesh,
            old.solids,
            clamp_half_finger(self.mesh),
            old.cavities,
            Drive.pump(),
            [*extra, *self._couple, self._force],
        )
        self._walls = contact_walls(self.mesh, Barrier().reach)
        heights = self.profile.pitch * np.arange(1, self.profile.units)
        on_section = [np.flatnonzero(np.abs(self.mesh.points[:, 2] - z) < 1e-9) for z in heights]
        self._sections = [SectionRotation(self.mesh, points) for points in on_section]
        self._tip = SectionRotation(self.mesh, self.mesh.facet_set("tip").points)
        self._line = _side_line(self.mesh)

    @property
    def rest_volumes(self) -> FloatArray:
        """Volumes of both chambers at rest, whole finger (2,) [mm^3]."""
        return np.asarray(self.model.rest_volumes / HALF)

    def rest(self) -> State:
        """The undeformed state."""
        return self.model.rest()

    def solve(self, asked: Asked, guess: State) -> Step:
        """The converged step with the asked volumes and loads.

        asked : what it shall have; guess : where Newton starts

        Raises StepFailed when it does not converge.
        """
        right, left = asked.volumes
        self.model.drive = Drive(("volume", "volume"), (HALF * right, HALF * left))
        for load in self._couple:
            load.scale = HALF * asked.couple / self._couple_arm
        self._force.scale = HALF * asked.force
        start = guess.copy()
        start.parameter = 1.0
        return self.model.solve(start, Control("parameter", 1.0))

    def measure(self, asked: Asked, step: Step) -> UnitState:
        """What a converged step says about each unit.

        asked : its volumes and loads; step : the solved state
        """
        unknowns = step.state.unknowns
        turns = np.array([0.0, *(section(unknowns)[0] for section in self._sections), self._tip(unknowns)[0]])
        middles, ends = self._line_places(unknowns)
        directions = (turns[1:] + turns[:-1]) / 2
        across = np.stack([-np.cos(directions), -np.sin(directions)], axis=1)
        force = np.array([-asked.force, 0.0])
        return UnitState(
            angles=np.diff(turns),
            moments=self._moments(asked, unknowns, middles),
            shears=across @ force,
            slips=self._slips(turns, ends, across),
            pressures=step.state.pressures.copy(),
            volumes=np.asarray((step.volumes - self.model.rest_volumes) / HALF),
            energy=step.energy / HALF,
            bend=float(turns[-1]),
            tip=(float(ends[-1, 0]), float(ends[-1, 1])),
            gap=min(wall.smallest_gap(step.state, 2.0)[0] for wall in self._walls),
        )

    def _line_places(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(x, z) of the side line at the units' middles (n, 2) and at base, boundaries, tip (n + 1, 2)."""
        now = self._places(unknowns)[self._line]
        rest = self.mesh.points[self._line, 2]
        n, pitch, cap = self.profile.units, self.profile.pitch, self.profile.cap
        edges = np.r_[-cap, pitch * np.arange(1, n), n * pitch + cap]
        at = [
            np.stack([np.interp(z, rest, now[:, axis]) for axis in (0, 2)], axis=1)
            for z in (pitch * (np.arange(n) + 0.5), edges)
        ]
        return at[0], at[1]

    def _moments(self, asked: Asked, unknowns: FloatArray, about: FloatArray) -> FloatArray:
        now = self._places(unknowns)
        moments = np.zeros(len(about))
        push = asked.couple / self._couple_arm
        for name, f_x, f_z in (
            ("tip", -asked.force, 0.0),
            ("tip_right", 0.0, push),
            ("tip_left", 0.0, -push),
        ):
            points, shares = self._areas[name]
            x, z = (shares / shares.sum()) @ now[points][:, [0, 2]]
            moments += (x - about[:, 0]) * f_z - (z - about[:, 1]) * f_x
        return moments

    def _slips(self, turns: FloatArray, ends: FloatArray, across: FloatArray) -> FloatArray:
        """Sideways places that rigid links with hinges at the units' middles leave unexplained, (n,)."""
        pitch, cap = self.profile.pitch, self.profile.cap
        below, above = np.full(len(turns) - 1, pitch / 2), np.full(len(turns) - 1, pitch / 2)
        below[0] += cap
        above[-1] += cap
        direction = np.stack([-np.sin(turns), np.cos(turns)], axis=1)
        rigid = below[:, None] * direction[:-1] + above[:, None] * direction[1:]
        return np.asarray(np.einsum("ki,ki->k", np.diff(ends, axis=0) - rigid, across))

    def _places(self, unknowns: FloatArray) -> FloatArray:
        return self.mesh.points + unknowns[: self.mesh.points.size].reshape(-1, 3)


def _side_line(mesh: Mesh) -> IntArray:
    """Points of the line x = 0 on the side face, base to tip; the axis itself bows with the partition."""
    y = mesh.points[:, 1]
    line = np.flatnonzero((np.abs(mesh.points[:, 0]) < 1e-9) & (np.abs(y - y.max()) < 1e-9))
    return line[np.argsort(mesh.points[line, 2])]


def _with_tip_halves(mesh: Mesh) -> Mesh:
    """The mesh with the tip face also named by its halves x > 0 and x < 0."""
    tip = mesh.facet_set("tip")
    x = mesh.points[tip.nodes, 0].mean(axis=1)
    halves = {"tip_right": tip.nodes[x > 1e-9], "tip_left": tip.nodes[x < -1e-9]}
    return replace(mesh, facets=mesh.facets | {name: FacetSet(tip.kind, n) for name, n in halves.items()})


def _nodal_areas(mesh: Mesh, facets: str) -> tuple[IntArray, FloatArray]:
    """Points of a facet set and the undeformed area that the shape function of each one carries [mm^2]."""
    loaded = mesh.facet_set(facets)
    kind = element_kind(loaded.kind)
    slopes = kind.shape_gradient(kind.quadrature_points)
    tangents = np.einsum("fai,qas->fqsi", mesh.points[loaded.nodes], slopes, optimize=True)
    areas = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=-1)
    shares = (areas * kind.quadrature_weights) @ kind.shape(kind.quadrature_points)
    points = loaded.points
    carried = np.bincount(loaded.nodes.ravel(), shares.ravel(), len(mesh.points))[points]
    return points, np.asarray(carried, dtype=float)
