"""A design as a model: half finger, two chambers, seam, a drive, and where its path may end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.design.finger import FingerDesign
from tubefoot.design.material import OgdenMaterial
from tubefoot.errors import ConfigError
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.contact import SelfContact
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.elements import PressureSpace
from tubefoot.fea.end_mesh import RigidEnds
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.film import Film
from tubefoot.fea.finger_mesh import DEFAULT_ELEMENT_SIZE, clamp_half_finger, finger_mesh
from tubefoot.fea.finger_tetrahedra import finger_tetrahedra
from tubefoot.fea.items import Item
from tubefoot.fea.landing import Limit
from tubefoot.fea.measures import RIGID_REGIONS, Centreline, SectionRotation
from tubefoot.fea.memory import Memory, Relaxation
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.obstacle import mirror_image
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.timeline import Stage, stages
from tubefoot.units import ATMOSPHERE_MPA, DEG, KPA, ML

HALF = 0.5
"""The modelled share of the finger."""

GOALS = (
    "pressure_right_kpa",
    "pressure_left_kpa",
    "volume_change_right_ml",
    "volume_change_left_ml",
    "pumped_volume_ml",
    "bend_deg",
)

HANDS = ("right", "left")

SLIT, CLOSED = 0.2, 0.1
"""A collapsed chamber: mean distance of its walls [mm], 2 V / A with A their area at rest, and the largest
share of its volume that may be left, down to half of that distance.

Walls in contact stand up to the barrier's reach apart, by default half of the first, and folds do not close
in their corners: less volume is squeezed out of the barrier.
"""

TIMES = ("ramp_s", "hold_s", "hold", "recover_s")
"""Settings that only a viscoelastic solve reads."""


class SolveSettings(Settings):
    """How a finger is solved."""

    until: Literal[
        "pressure_right_kpa",
        "pressure_left_kpa",
        "volume_change_right_ml",
        "volume_change_left_ml",
        "pumped_volume_ml",
        "bend_deg",
    ] = "pressure_right_kpa"
    """The quantity that the path goes to."""
    target: Annotated[float, Field(ge=-1e4, le=1e4)] = 35.0
    """Its value, in the unit that its name bears; a negative one reverses the pump."""
    states: Annotated[int, Field(ge=1, le=400)] = 8
    """Into how many states the way is cut, about."""
    element_size_mm: Annotated[float, Field(ge=0.2, le=10.0)] = DEFAULT_ELEMENT_SIZE
    mesh_kind: Literal["hexahedra", "tetrahedra"] = "hexahedra"
    """hexahedra: the profile swept along y; tetrahedra: the solid meshed by Netgen."""
    ports: bool = False
    """Whether tubes, bores and their plugs are part of the solid; needs tetrahedra."""
    pressure_space: PressureSpace = "continuous"
    """Pressure space that goes with the cells; on tetrahedra only the continuous one does not lock."""
    cavities: Literal["coupled", "volume", "pressure", "filtered"] = "coupled"
    """coupled: what is pumped into the right chamber comes out of the left one; volume, pressure: both
    chambers' volume changes or pressures are prescribed, the left one's as `left_over_right` of the right;
    filtered: a grid of pressures, of which those states are kept whose volume changes a pump could make."""
    left_over_right: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0
    air_right_ml: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Trapped-air column of the right pressure branch at zero gauge."""
    air_left_ml: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    self_contact: bool = True
    """Whether walls that touch hold each other; without, the path ends where they do."""
    contact_reach_mm: Annotated[float, Field(ge=0.01, le=1.0)] = 0.1
    """Gap from which walls repel each other; cut to half the smallest gap at rest."""
    fields: Literal["all", "last", "none"] = "all"
    """Of which states stress fields are written."""
    rigid_parts: Literal["clamp", "modelled"] = "clamp"
    """clamp: the base cap is held at its underside; modelled: socket, plate and tubes are stiff parts of the
    design's rigid material, and the plate's underside is held."""
    viscoelastic: bool = False
    """Whether the body relaxes with the design's Prony terms; the solve is one in time then."""
    ramp_s: Annotated[float, Field(gt=0.0, le=1e6)] = 2.0
    """Time in which a viscoelastic solve goes evenly to the target; terms from 0.1 s on are known."""
    hold_s: Annotated[float, Field(ge=0.0, le=1e8)] = 0.0
    """How long it is held there."""
    hold: Literal["pump", "goal"] = "pump"
    """pump: the pump stands still and the pressures relax; goal: the goal's quantity is kept (creep)."""
    recover_s: Annotated[float, Field(ge=0.0, le=1e8)] = 0.0
    """After the hold the drive runs back to where it started within `ramp_s` and stays so long; 0: it does
    not."""

    @model_validator(mode="after")
    def _reachable(self) -> Self:
        if self.target == 0.0:
            raise ValueError(f"the target {self.until} = 0 is the state at rest; name another value")
        if self.ports and self.mesh_kind == "hexahedra":
            raise ValueError(
                "ports are not part of the swept hexahedra; solve with mesh_kind = tetrahedra "
                "(--mesh-kind tetrahedra)"
            )
        if self.rigid_parts == "modelled" and self.mesh_kind == "tetrahedra":
            raise ValueError(
                "rigid_parts = modelled is for the swept hexahedra; "
                "tetrahedra have their tubes by ports = true"
            )
        if self.cavities == "filtered" and (
            self.until != "pressure_right_kpa" or self.air_right_ml or self.air_left_ml or self.viscoelastic
        ):
            raise ValueError(
                "cavities = filtered goes to a pressure_right_kpa, without trapped air and not in time"
            )
        if self.until.startswith("pressure") and self.target * KPA <= -ATMOSPHERE_MPA:
            raise ValueError(
                f"the target {self.until} = {self.target:g} kPa is at or below absolute vacuum "
                f"({-ATMOSPHERE_MPA / KPA:.1f} kPa gauge)"
            )
        return self

    @model_validator(mode="after")
    def _timely(self) -> Self:
        if self.viscoelastic:
            return self
        defaults = type(self).model_fields
        idle = [name for name in TIMES if getattr(self, name) != defaults[name].default]
        if idle:
            raise ValueError(
                f"{', '.join(idle)} belong to a solve in time; set viscoelastic = true (--viscoelastic) or "
                "leave them out"
            )
        return self


@dataclass
class FingerModel:
    """A finger ready to be solved, and what is read off it."""

    design: FingerDesign
    settings: SolveSettings
    mesh: Mesh
    solid: Solid
    model: Model
    tip: SectionRotation
    centreline: Centreline
    walls: list[SelfContact]
    memory: Memory | None = None

    def timeline(self) -> list[Stage]:
        """The stages of a viscoelastic solve."""
        times = (self.settings.ramp_s, self.settings.hold_s, self.settings.recover_s)
        return stages(self.goal.control, *times, self.settings.states, self.settings.hold == "goal")

    @property
    def goal(self) -> Limit:
        """Where the path goes."""
        return Limit(goal_control(self.settings, self.tip), "goal reached")

    @property
    def limits(self) -> list[Limit]:
        """Where the path may end before: absolute vacuum or full collapse of either chamber."""
        found = []
        for number, hand in enumerate(("right", "left")):
            vacuum = Control("pressure", self._vacuum(number), cavity=number)
            share, apart = self._collapsed(number)
            change = -(1.0 - share) * self.model.cavities[number].rest_volume
            collapse = Control("volume_change", change, cavity=number)
            left = f"its walls {apart:.3g} mm apart on average, {100 * share:.1f} % of its volume left"
            found += [
                Limit(vacuum, f"absolute vacuum in the {hand} chamber (cavitation)"),
                Limit(collapse, f"full collapse of the {hand} chamber ({left})"),
            ]
        return found

    def _collapsed(self, number: int) -> tuple[float, float]:
        """Share of its volume left in a chamber that has collapsed, mean distance of its walls [mm]."""
        area = 2.0 * float(self.walls[number].areas.sum())  # each side of a contact carries half
        slit = 0.5 * SLIT * area / self.model.cavities[number].rest_volume
        share = min(slit, max(CLOSED, 0.5 * slit), 0.5)
        return share, SLIT * share / slit

    def _vacuum(self, number: int) -> float:
        """Gauge pressure at which a chamber's path ends [MPa]: vacuum, just above it with an air column."""
        return 0.995 * -ATMOSPHERE_MPA if self.model.cavities[number].air_volume > 0 else -ATMOSPHERE_MPA


def build_finger(design: FingerDesign, settings: SolveSettings) -> FingerModel:
    """The model of a design.

    design : the finger; settings : mesh size, drive, goal

    Raises GeometryError when the mesh is not fit for a solve.
    """
    mesh = design_mesh(design, settings)
    rigid = OgdenLaw.elastic(design.rigid.youngs_modulus_mpa, design.rigid.poisson_ratio)
    laws = {"*": ogden_law(design.body), **dict.fromkeys(RIGID_REGIONS, rigid)}
    solid = Solid(mesh, laws, pressure=settings.pressure_space)
    air = (settings.air_right_ml, settings.air_left_ml)
    cavities = [
        Cavity(mesh, f"cavity_{hand}", number, air_volume=HALF * air[number] * ML)
        for number, hand in enumerate(("right", "left"))
    ]
    walls = contact_walls(mesh, settings.contact_reach_mm)
    others: list[Item] = [*seam_films(mesh, design)]
    if settings.self_contact:
        images = [mirror_image(mesh, f"lid_{hand}", Barrier(settings.contact_reach_mm)) for hand in HANDS]
        others += [*walls, *images]
    model = Model(mesh, [solid], clamp_half_finger(mesh), cavities, _drive(settings), others)
    profile = design.profile
    return FingerModel(
        design,
        settings,
        mesh,
        solid,
        model,
        SectionRotation(mesh, mesh.facet_set("tip").points),
        Centreline(mesh, profile.bellows_length, profile.pitch),
        walls,
        _memory(mesh, solid, design) if settings.viscoelastic else None,
    )


def contact_walls(mesh: Mesh, reach: float) -> list[SelfContact]:
    """The surfaces of a finger that may touch themselves: both chambers and both outsides.

    mesh : of a finger; reach : gap from which walls repel each other [mm]
    """
    inside = ("partition_inside", "valley_inside", "flank_inside", "crest_inside", "cap_inside", "lid")
    outside = ("valley_outside", "flank_outside", "crest_outside")
    return [
        SelfContact(
            mesh, [f"{part}_{hand}" for part in parts if f"{part}_{hand}" in mesh.facets], Barrier(reach)
        )
        for parts in (inside, outside)
        for hand in ("right", "left")
    ]


def design_mesh(design: FingerDesign, settings: SolveSettings) -> Mesh:
    """The half finger y >= 0, swept or of tetrahedra; regions and facet sets have the same names.

    design : the finger; settings : kind of mesh, element size, whether with ports
    """
    if settings.mesh_kind == "hexahedra":
        rigid = RigidEnds.of(design) if settings.rigid_parts == "modelled" else None
        return finger_mesh(design.profile, settings.element_size_mm, rigid=rigid)
    return finger_tetrahedra(design, settings.element_size_mm, settings.ports)


def _memory(mesh: Mesh, solid: Solid, design: FingerDesign) -> Memory:
    """What the soft body remembers; rigid parts are elastic."""
    relaxation = Relaxation(design.body.relaxation_time_s, design.body.relaxation_share)
    rigid = [number for number, name in enumerate(mesh.regions) if name in RIGID_REGIONS]
    return Memory(solid, relaxation, rigid)


def seam_films(mesh: Mesh, design: FingerDesign) -> list[Film]:
    """The resin film on the mid-plane, its half on this side; none for the ideal seam.

    mesh : with the facet set mid_plane; design : says how thick and stiff the film is
    """
    seam = design.seam
    if seam.modulus_mpa == 0.0 or seam.thickness_mm == 0.0:
        return []
    return [Film(mesh, "mid_plane", HALF * seam.thickness_mm, seam.modulus_mpa, seam.poisson_ratio)]


def ogden_law(material: OgdenMaterial) -> OgdenLaw:
    """The law of a body material, its scale applied.

    material : moduli, exponents, bulk modulus
    """
    return OgdenLaw(
        tuple(material.scale * mu for mu in material.mu_mpa), material.alpha, material.bulk_modulus_mpa
    )


def goal_control(settings: SolveSettings, tip: SectionRotation) -> Control:
    """The control that lands on the wanted value.

    settings : name the quantity and its value; tip : measures the bend angle
    """
    name, target = settings.until, settings.target
    cavity = 1 if "left" in name else 0
    if name.startswith("pressure"):
        return Control("pressure", target * KPA, cavity)
    if name.startswith("volume_change"):
        return Control("volume_change", HALF * target * ML, cavity)
    if name == "pumped_volume_ml":
        if settings.cavities in ("pressure", "filtered"):
            raise ConfigError(
                "until pumped_volume_ml needs a drive by volume; use --cavities coupled or volume"
            )
        return Control("parameter", HALF * target * ML)
    return Control("measure", target * DEG, measure=tip)


def _drive(settings: SolveSettings) -> Drive:
    if settings.cavities == "coupled":
        return Drive.pump()
    kind: Literal["volume", "pressure"] = "volume" if settings.cavities == "volume" else "pressure"
    return Drive((kind, kind), (1.0, settings.left_over_right))


def largest_stretch(solid: Solid, unknowns: np.ndarray) -> np.ndarray:
    """Largest principal stretch at the quadrature points, (n_cells, n_q).

    solid : the cells; unknowns : displacements first [mm]
    """
    nodal = unknowns[3 * solid.block.nodes[:, :, None] + np.arange(3)]
    gradient = np.einsum("cai,cqaj->cqij", nodal, solid.gradients, optimize=True) + np.eye(3)
    return np.sqrt(np.linalg.eigvalsh(np.einsum("cqki,cqkj->cqij", gradient, gradient))[..., -1])
