"""The file of a reduced finger: small TOML with a version, what it was made from, and how far it is off.

Written by `tubefoot reduce`; one for the reference design ships with the package.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import Field

from tubefoot.config import Settings, parse_settings, read_toml
from tubefoot.errors import ConfigError
from tubefoot.records import write_whole
from tubefoot.reduced.chain import FingerRange
from tubefoot.reduced.finger import ReducedFinger
from tubefoot.reduced.law import UnitLaw
from tubefoot.reduced.relaxation import MEASURED_C, ROOM_C, Prony
from tubefoot.units import DEG, KPA

FORMAT_VERSION = 1
"""Version of the file's layout; a reader refuses a later one."""

GRAM = 1e-6
"""In the mass unit that goes with N, mm and s, the tonne."""


class LawTable(Settings):
    """Polynomial of one law."""

    exponents: tuple[tuple[int, int, int], ...]
    """Of angle, pressure difference, pressure sum."""
    coefficients_mj: tuple[float, ...]
    """One for each exponent triple."""

    def to_law(self) -> UnitLaw:
        """The law, in inside units."""
        if len(self.exponents) != len(self.coefficients_mj):
            raise ConfigError(
                f"{len(self.exponents)} exponent triples but {len(self.coefficients_mj)} coefficients in a "
                "law; the file is damaged, run `tubefoot reduce` again"
            )
        return UnitLaw(self.exponents, self.coefficients_mj)

    @classmethod
    def of(cls, law: UnitLaw) -> LawTable:
        """The table of a law.

        law : to be written
        """
        return cls(exponents=law.terms, coefficients_mj=law.coefficients)


class RangeTable(Settings):
    """Where the law was identified."""

    unit_angle_deg: Annotated[float, Field(gt=0)]
    pressure_low_kpa: Annotated[float, Field(lt=0)]
    pressure_high_kpa: Annotated[float, Field(gt=0)]


class RelaxationTable(Settings):
    """Prony terms of the wall over its equilibrium modulus, as measured at 20 degC."""

    time_s: tuple[float, ...] = ()
    share: tuple[float, ...] = ()


class ReducedFile(Settings):
    """All that the file of a reduced finger holds."""

    version: int
    name: str
    units: Annotated[int, Field(ge=1, le=48)]
    pitch_mm: Annotated[float, Field(gt=0)]
    cap_mm: Annotated[float, Field(gt=0)]
    half_width_mm: Annotated[float, Field(gt=0)]
    """Middle line to the outside of a crest."""
    height_mm: Annotated[float, Field(gt=0)]
    """Size across the bending plane."""
    unit_mass_g: Annotated[float, Field(gt=0)]
    """Wall and water of one unit."""
    cap_mass_g: Annotated[float, Field(gt=0)]
    shear_compliance_mm_per_n: Annotated[float, Field(ge=0)] = 0.0
    """Sideways shift of a unit's upper end by shear force."""
    range: RangeTable
    inner: LawTable
    base: LawTable
    tip: LawTable
    relaxation: RelaxationTable = RelaxationTable()
    provenance: dict[str, str | int | float]
    """Design hash, program version, the command that made it, mesh, number of states."""
    errors: dict[str, float]
    """Against finite element states held out of the fit."""

    def to_finger(self) -> ReducedFinger:
        """The finger, in inside units."""
        return ReducedFinger(
            name=self.name,
            n_units=self.units,
            pitch=self.pitch_mm,
            cap=self.cap_mm,
            inner=self.inner.to_law(),
            base=self.base.to_law(),
            tip=self.tip.to_law(),
            valid=FingerRange(
                self.range.unit_angle_deg * DEG,
                self.range.pressure_low_kpa * KPA,
                self.range.pressure_high_kpa * KPA,
            ),
            half_width=self.half_width_mm,
            height=self.height_mm,
            unit_mass=self.unit_mass_g * GRAM,
            cap_mass=self.cap_mass_g * GRAM,
            shear_compliance=self.shear_compliance_mm_per_n,
        )

    def to_prony(self, temperature_c: float = ROOM_C) -> Prony:
        """The relaxation of its wall.

        temperature_c : of the room [degC]; the terms in the file are of `MEASURED_C`
        """
        return Prony(self.relaxation.share, self.relaxation.time_s).warmed(temperature_c - MEASURED_C)


def read_reduced(path: Path | str) -> ReducedFile:
    """The file of a reduced finger.

    path : written by `tubefoot reduce`

    Raises ConfigError when it is missing, damaged, or of a later version.
    """
    table = read_toml(Path(path))
    return _parsed(table, str(path))


def load_reduced(path: Path | str) -> ReducedFinger:
    """The reduced finger in a file.

    path : written by `tubefoot reduce`

    Raises ConfigError when it is missing, damaged, or of a later version.
    """
    return read_reduced(path).to_finger()


def write_reduced(path: Path, content: ReducedFile) -> Path:
    """The path of the file, after writing it.

    path : where to; content : what it holds
    """
    return write_whole(path, tomli_w.dumps(content.model_dump(mode="json"), indent=2))


@cache
def reference_file() -> ReducedFile:
    """The file of the 12-unit reference finger that ships with the package."""
    source = resources.files("tubefoot.reduced") / "data" / "reference-12.toml"
    with resources.as_file(source) as path:
        return read_reduced(path)


def reference_finger() -> ReducedFinger:
    """The 12-unit reference finger, reduced."""
    return reference_file().to_finger()


def _parsed(table: dict[str, Any], source: str) -> ReducedFile:
    version = table.get("version")
    if not isinstance(version, int):
        raise ConfigError(f"{source}: no `version`; this is not the file of a reduced finger")
    if version > FORMAT_VERSION:
        raise ConfigError(
            f"{source}: written by a later Tubefoot (layout {version}, this one reads up to "
            f"{FORMAT_VERSION}); update Tubefoot, or run `tubefoot reduce` again"
        )
    return parse_settings(table, ReducedFile, source=source)
