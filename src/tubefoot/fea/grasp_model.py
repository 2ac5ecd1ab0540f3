"""A finger and what it grasps as one model: half the finger, a quarter of the object, and their contact.

Two alike fingers pumped alike make the middle plane between them one of symmetry, and so is y = 0: the model
is the half y >= 0 of the finger at x > 0 with the part of the object on its side. The finger's frame is kept,
z = 0 at its first unit; the grasp's middle plane lies at -x. Gravity and friction are left out; what friction
would have to bear along z is reported.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.body_contact import BodyContact
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger
from tubefoot.fea.finger_model import (
    HALF,
    FingerModel,
    SolveSettings,
    contact_walls,
    design_mesh,
    ogden_law,
    seam_films,
)
from tubefoot.fea.grasp_settings import GraspSettings
from tubefoot.fea.items import Item, State
from tubefoot.fea.mean_hold import MeanHold
from tubefoot.fea.measures import Centreline, SectionRotation
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.object_mesh import beside, object_mesh
from tubefoot.fea.rigid_grasp import RigidContact
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import Tolerance
from tubefoot.fea.touch import Touch
from tubefoot.units import KPA, ML

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

INNER_WALLS = ("valley_outside_left", "flank_outside_left", "crest_outside_left")
"""Facet sets of the finger's side that faces the object."""
PARKED_MM = 40.0
"""How far from its place the object waits while the finger opens."""
HOLD_STIFFNESS = 10.0
"""Force over shift that holds the object along z [N/mm]; it moves by a few micrometres."""
AHEAD_MM = 4.0
"""Gap up to which the sparse pattern is prepared, so that it seldom has to grow."""
TRIAL_GAP = -1.0
"""Overlap over the reach that a trial state of Newton's method may have: the barrier grows fast beyond."""


@dataclass(frozen=True)
class Grip:
    """Force of one whole finger on the object.

    normal : towards the middle plane [N]; axial : along z [N]
    height : of the normal force's line above the outer face of the base caps [mm], None without contact
    """

    normal: float
    axial: float
    height: float | None


@dataclass
class GraspModel:
    """A finger with the object in its reach.

    finger : its model; contact : of finger and object; food : the object's cells, None for a rigid one
    middle : x of the grasp's middle plane [mm]
    """

    settings: GraspSettings
    finger: FingerModel
    contact: BodyContact | RigidContact
    food: Solid | None
    middle: float
    _object_points: IntArray

    @property
    def model(self) -> Model:
        """What is solved."""
        return self.finger.model

    def placed(self, state: State) -> State:
        """A state with the object moved to its place, as it is.

        state : with the object parked
        """
        self.put_in_place()
        found = state.copy()
        found.unknowns[3 * self._object_points] += PARKED_MM
        return found

    def put_in_place(self) -> None:
        """Move a rigid object to its place; a soft one is there by its displacements."""
        if isinstance(self.contact, RigidContact):
            self.contact.place(True)

    def contact_pressure(self, state: State) -> FloatArray:
        """Contact pressure at all points, across the gripper (n_points,) [kPa], zero off the patch.

        state : a converged one, of a soft object
        """
        assert isinstance(self.contact, BodyContact)
        return self.contact.point_pressures(state) / KPA

    def clearance(self, state: State) -> float:
        """Smallest gap between finger and object [mm], negative for an overlap, infinite beyond 4 mm.

        state : where to look
        """
        return self.contact.clearance(state, AHEAD_MM)

    def grip(self, state: State) -> Grip:
        """What one whole finger does to the object.

        state : a converged one
        """
        force, moment = self.contact.resultant(state)
        cap = self.finger.design.profile.cap
        height = moment / force[0] + cap if abs(force[0]) > 1e-9 else None
        return Grip(-float(force[0]) / HALF, float(force[2]) / HALF, height)

    def touch(self, state: State) -> Touch:
        """Pressures on the half contact patch.

        state : a converged one
        """
        return self.contact.touch(state)

    def reactions(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Forces of the clamped base on the finger and of the other half on the object, whole, (3,) each [N].

        state : a converged one
        """
        self.model.evaluate(state, stiff=False)
        nodal = self.model.system.residual[: self.finger.mesh.points.size].reshape(-1, 3)
        base = self.finger.mesh.facet_set("base").points
        on_finger = nodal[base].sum(axis=0) / HALF
        if self.food is None:
            return on_finger, np.full(3, np.nan)
        return on_finger, nodal[self.finger.mesh.facet_set("object_middle").points].sum(axis=0) / HALF


def build_grasp(design: FingerDesign, settings: SolveSettings, grasp: GraspSettings) -> GraspModel:
    """The model of a design and an object.

    design : the finger; settings : its mesh and drive; grasp : the object and its place

    Raises ConfigError for settings that do not go with a grasp, GeometryError for an unfit mesh.
    """
    if settings.cavities != "coupled" or settings.mesh_kind != "hexahedra" or settings.viscoelastic:
        raise ConfigError("a grasp needs cavities = coupled and mesh_kind = hexahedra, and not viscoelastic")
    alone, profile, thing = design_mesh(design, settings), design.profile, grasp.object
    gap = design.gripper.finger_gap_mm if grasp.finger_gap_mm is None else grasp.finger_gap_mm
    middle = -(profile.crest_outside + gap / 2.0)
    place = np.array([middle - grasp.reach_mm, 0.0, grasp.height_mm - profile.cap])
    mesh, clamped = alone, clamp_half_finger(alone)
    if not thing.rigid:
        mesh = _both_bodies(alone, grasp, place)
        across, cut = (mesh.facet_set(f"object_{name}").points for name in ("middle", "cut"))
        clamped = {0: np.r_[clamped[0], across], 1: np.r_[clamped[1], cut], 2: clamped[2]}
    solids = [Solid(mesh, {"*": ogden_law(design.body)}, 0, settings.pressure_space)]
    contact: BodyContact | RigidContact
    items: list[Item] = [*seam_films(mesh, design)]
    if thing.rigid:
        contact = RigidContact(mesh, INNER_WALLS, thing, place, PARKED_MM, _barrier(grasp))
        items += contact.items
    else:
        contact = BodyContact(mesh, INNER_WALLS, "object_skin", barrier=_barrier(grasp))
        items += [contact, MeanHold(across, 2, HOLD_STIFFNESS)]
        law = OgdenLaw.elastic(thing.youngs_modulus_kpa * KPA, thing.poisson_ratio)
        solids.append(Solid(mesh, {"*": law}, 1, "continuous", 3 * len(mesh.points) + solids[0].n_own))
    walls = contact_walls(mesh, settings.contact_reach_mm)
    items += walls if settings.self_contact else []
    tolerance = Tolerance(min_gap=TRIAL_GAP * grasp.reach_mm)
    model = Model(mesh, solids, clamped, _cavities(mesh, settings), Drive.pump(), items, tolerance)
    tip = SectionRotation(mesh, mesh.facet_set("tip").points)
    line = Centreline(alone, profile.bellows_length, profile.pitch)
    finger = FingerModel(design, settings, mesh, solids[0], model, tip, line, walls)
    points = np.arange(len(alone.points), len(mesh.points))
    return GraspModel(grasp, finger, contact, None if thing.rigid else solids[1], middle, points)


def _barrier(grasp: GraspSettings) -> Barrier:
    stiffness = grasp.touch_pressure_kpa * KPA / grasp.reach_mm
    return Barrier(grasp.reach_mm, stiffness, depth=grasp.object.sizes_mm[0] / 2.0, ahead=AHEAD_MM)


def _cavities(mesh: Mesh, settings: SolveSettings) -> list[Cavity]:
    air = (settings.air_right_ml, settings.air_left_ml)
    return [
        Cavity(mesh, f"cavity_{hand}", number, air_volume=HALF * air[number] * ML)
        for number, hand in enumerate(("right", "left"))
    ]


def _both_bodies(finger: Mesh, grasp: GraspSettings, place: FloatArray) -> Mesh:
    """The finger and, parked away from its place, the object, each in a block of its own."""
    thing = grasp.object
    body = object_mesh(thing.sizes_mm, thing.round_axes, grasp.object_element_mm, thing.rounding_mm)
    both = beside(finger, body, place - [PARKED_MM, 0.0, 0.0])
    block, n = both.blocks[0], finger.n_cells
    parts = [replace(block, nodes=block.nodes[k], region=block.region[k]) for k in (slice(n), slice(n, None))]
    return replace(both, blocks=tuple(parts))
