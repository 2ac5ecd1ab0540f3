"""Any soft solid with one or two fluid chambers: its mesh or STEP file, its named sets, its materials.

Axes as for a finger: the part stands along z on its base, bends in the x-z plane; a mid-plane of symmetry, if
only half of the part is meshed, is y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tubefoot.config import Settings, load_settings
from tubefoot.design.material import ElasticMaterial, OgdenMaterial
from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.elements import element_kind
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.file_mesh import FileMesh, read_mesh_file
from tubefoot.fea.finger_model import HALF, SolveSettings, goal_control, ogden_law
from tubefoot.fea.landing import Limit
from tubefoot.fea.measures import SectionRotation
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.named_mesh import named_mesh
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.units import ATMOSPHERE_MPA, ML

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LENGTH_UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
HANDS = ("right", "left")
STEP_SUFFIXES = (".step", ".stp")
ON_PLANE = 1e-6
"""Distance of a point from the mid-plane over the part's size up to which it lies in it."""
OPEN_SHARE = 1e-6
"""Sum of a wall's area vectors over its area from which it counts as open."""


class SetNames(Settings):
    """Which named surface set of the file is what; upper and lower case are the same."""

    base: str = "base"
    """Held along all axes."""
    tip: str = "tip"
    """Its turn is the bend angle."""
    cavity_right: str = "cavity_right"
    """Wall of the chamber that is pumped into; closed, or closed by the mid-plane."""
    cavity_left: str | None = None
    """Wall of the other chamber; if not named, the set `cavity_left` where the file has one."""
    mid_plane: str | None = None
    """Plane of symmetry y = 0 of half a part; if not named, the set `mid_plane` where the file has one."""


class SolidPart(Settings):
    """A part to be solved: a file with a mesh or a STEP solid, its named sets and its materials."""

    name: Annotated[str, Field(min_length=1, max_length=80)] = "part"
    mesh: str
    """File with the mesh (.msh, .inp, .vtu) or the solid (.step); relative to the settings file."""
    length_unit: Literal["um", "mm", "cm", "m", "inch"] = "mm"
    """Unit of length of a mesh file; a STEP file says it itself."""
    raise_to_quadratic: bool = False
    """Give linear cells mid-nodes on their straight edges."""
    sets: SetNames = SetNames()
    body: OgdenMaterial = OgdenMaterial()
    """Material of all cells that `elastic` does not name."""
    elastic: dict[str, ElasticMaterial] = Field(default_factory=dict)
    """Stiff material of named cell sets."""


@dataclass
class PartModel:
    """A part ready to be solved, and what is read off it.

    share : the modelled share of the part, 1/2 for half of it
    """

    part: SolidPart
    settings: SolveSettings
    mesh: Mesh
    solid: Solid
    model: Model
    tip: SectionRotation
    middle: SectionRotation
    share: float

    @property
    def goal(self) -> Limit:
        """Where the path goes."""
        return Limit(_goal_control(self), "goal reached")

    @property
    def limits(self) -> list[Limit]:
        """Where the path may end before: absolute vacuum in a chamber."""
        return [
            Limit(
                Control("pressure", -ATMOSPHERE_MPA * (0.995 if cavity.air_volume else 1.0), cavity.number),
                f"absolute vacuum in the {hand} chamber (cavitation)",
            )
            for cavity, hand in zip(self.model.cavities, HANDS, strict=False)
        ]


def load_part(path: Path) -> SolidPart:
    """The part that a settings file describes, its mesh file found beside it.

    path : TOML file

    Raises ConfigError when the file or the mesh file that it names cannot be used.
    """
    part = load_settings(path, SolidPart)
    return part.model_copy(update={"mesh": str(path.parent / part.mesh)})


def build_part(part: SolidPart, settings: SolveSettings) -> PartModel:
    """The model of a part.

    part : files, sets and materials; settings : drive, goal, and element size for a STEP file

    Raises ConfigError for a set that is missing, GeometryError for a mesh or cavity that cannot be solved.
    """
    mesh = part_mesh(part, settings.element_size_mm)
    share = _share(mesh, part.mesh)
    unknown = sorted(set(part.elastic) - set(mesh.regions))
    if unknown:
        raise ConfigError(f"[elastic.{unknown[0]}]: the mesh has the cell sets {', '.join(mesh.regions)}")
    laws = {"*": ogden_law(part.body)}
    laws |= {
        name: OgdenLaw.elastic(stiff.youngs_modulus_mpa, stiff.poisson_ratio)
        for name, stiff in part.elastic.items()
    }
    solid = Solid(mesh, laws, pressure=settings.pressure_space)
    air = (settings.air_right_ml, settings.air_left_ml)
    cavities = []
    for number, hand in enumerate(HANDS):
        if f"cavity_{hand}" in mesh.facets:
            require_fluid(mesh, f"cavity_{hand}", part.mesh)
            cavities.append(Cavity(mesh, f"cavity_{hand}", number, air_volume=share * air[number] * ML))
    model = Model(mesh, [solid], _held(mesh), cavities, _drive(settings, len(cavities)))
    middle = SectionRotation(mesh, _middle_points(mesh))
    return PartModel(
        part, settings, mesh, solid, model, SectionRotation(mesh, mesh.facet_set("tip").points), middle, share
    )


def part_mesh(part: SolidPart, element_size: float) -> Mesh:
    """The mesh of a part, its facet sets called by their roles.

    part : files and set names; element_size : longest edge of a tetrahedron where a STEP file is meshed [mm]
    """
    path = Path(part.mesh)
    if path.suffix.lower() in STEP_SUFFIXES:
        from tubefoot.fea.tetrahedra import step_mesh

        found, scale = step_mesh(path, element_size), 1.0
    else:
        found, scale = read_mesh_file(path), LENGTH_UNITS[part.length_unit]
    return named_mesh(found, _roles(part.sets, found), scale, part.raise_to_quadratic)


def require_fluid(mesh: Mesh, facets: str, source: str) -> None:
    """Raise GeometryError where a wall does not close a volume of fluid, by itself or with the plane y = 0.

    mesh : the mesh; facets : name of the wall; source : what to call the file

    The area vectors of a closed surface sum to zero; of one that a plane closes, to a normal of that plane.
    """
    wall = mesh.facet_set(facets)
    kind = element_kind(wall.kind)
    positions = mesh.points[wall.nodes]
    slopes = kind.shape_gradient(kind.quadrature_points)
    tangents = np.einsum("fai,qad->fqdi", positions, slopes)
    areas = np.einsum("fqi,q->fqi", np.cross(tangents[:, :, 0], tangents[:, :, 1]), kind.quadrature_weights)
    total, surface = areas.sum(axis=(0, 1)), float(np.linalg.norm(areas, axis=-1).sum())
    if "mid_plane" in mesh.facets:
        total[1] = 0.0
    if float(np.linalg.norm(total)) > OPEN_SHARE * surface:
        raise GeometryError(
            f"{source}: the wall `{facets}` is not closed: an opening of {np.linalg.norm(total):.3g} mm^2 "
            f"faces ({total[0]:.3g}, {total[1]:.3g}, {total[2]:.3g}); let the set hold every face of the "
            "chamber"
        )
    places = np.einsum("qa,fai->fqi", kind.shape(kind.quadrature_points), positions)
    volume = -float(np.einsum("fqi,fqi->", places, areas)) / 3.0
    if volume <= 0.0:
        raise GeometryError(
            f"{source}: the wall `{facets}` encloses the solid, not a fluid (volume {volume:.3g} mm^3): it "
            "is the outer surface; name the surface of the chamber"
        )


def _roles(sets: SetNames, found: FileMesh) -> dict[str, str]:
    """Role to set name; roles that are not named take the set of their own name where the file has it."""
    known = {name.lower() for name in found.surface_names}
    roles = {role: name for role, name in sets.model_dump().items() if name is not None}
    for role in ("cavity_left", "mid_plane"):
        if role not in roles and role in known:
            roles[role] = role
    return roles


def _share(mesh: Mesh, source: str) -> float:
    if "mid_plane" not in mesh.facets:
        return 1.0
    y = mesh.points[mesh.facet_set("mid_plane").points, 1]
    if np.abs(y).max() > ON_PLANE * np.ptp(mesh.points, axis=0).max():
        raise GeometryError(
            f"{source}: the mid-plane spans y = {y.min():.3g} to {y.max():.3g} mm, must be the plane y = 0; "
            "turn or move the part"
        )
    return 0.5


def _held(mesh: Mesh) -> dict[int, IntArray]:
    base = mesh.facet_set("base").points
    middle = mesh.facet_set("mid_plane").points if "mid_plane" in mesh.facets else base[:0]
    return {0: base, 1: np.union1d(base, middle), 2: base}


def _middle_points(mesh: Mesh) -> IntArray:
    """Points about half way between base and tip: of the layer there that holds some dozens."""
    ends = [mesh.points[mesh.facet_set(name).points, 2].mean() for name in ("base", "tip")]
    distance = np.abs(mesh.points[:, 2] - np.mean(ends))
    reach = max(abs(ends[1] - ends[0]) / 24.0, float(np.sort(distance)[min(40, len(distance) - 1)]))
    return np.flatnonzero(distance <= reach)


def _drive(settings: SolveSettings, n_cavities: int) -> Drive:
    coupled = settings.cavities == "coupled"
    kind: Literal["volume", "pressure"] = "pressure" if settings.cavities == "pressure" else "volume"
    rates = (1.0, -1.0 if coupled else settings.left_over_right)
    return Drive((kind,) * n_cavities, rates[:n_cavities])


def _goal_control(model: PartModel) -> Control:
    control = goal_control(model.settings, model.tip)
    if control.cavity >= len(model.model.cavities):
        raise ConfigError(f"until {model.settings.until}: the part has one chamber, the right one")
    if control.quantity in ("parameter", "volume_change"):
        return replace(control, target=control.target * model.share / HALF)
    return control
