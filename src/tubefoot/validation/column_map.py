"""The column map: a TOML file that says which column of a foreign CSV is what, and in which unit.

    separator = ";"
    decimal = ","
    [columns.time]
    name = "Zeit"
    unit = "ms"
    [columns.pressure_right]
    name = "P1"
    unit = "mbar"

Nothing is guessed: a column without a unit is an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from tubefoot.config import Settings, load_settings
from tubefoot.quantities import factor

DRIVE_UNITS: dict[str, float] = {"1": 1.0, "%": 0.01, "percent": 0.01, "pwm255": 1 / 255, "direction": 1.0}
"""Units of the pump's signed drive: share, per cent, counts of an 8-bit PWM, or only its sign."""

QUANTITIES = {
    "time": "time",
    "pressure_right": "stress",
    "pressure_left": "stress",
    "angle": "angle",
    "angle_sigma": "angle",
    "pumped_volume": "volume",
}


class Column(Settings):
    """One column of a foreign table."""

    name: str = Field(min_length=1)
    """header in the file; with header_rows = 0 the number of the column, from 1"""
    unit: str
    """kPa, mbar, psi, deg, rad, ms, ...; the error of an unknown one lists those that are known"""
    sign: Literal[1, -1] = 1
    """-1 where the source counts the other way"""

    def factor(self, quantity: str) -> float:
        """What a cell is multiplied with to be in inside units.

        quantity : of `tubefoot.quantities`, or `drive`
        """
        if quantity == "drive":
            if self.unit not in DRIVE_UNITS:
                raise ValueError(
                    f"`{self.unit}` is not a unit of the pump's drive that is known here: "
                    f"{', '.join(DRIVE_UNITS)}"
                )
            return self.sign * DRIVE_UNITS[self.unit]
        return self.sign * factor(quantity, self.unit)


class Columns(Settings):
    """Which columns there are; time and both pressures are needed."""

    time: Column
    """of the sample"""
    pressure_right: Column
    """of the right branch"""
    pressure_left: Column
    """of the left branch"""
    angle: Column | None = None
    """bend of the tip, positive towards the left chamber"""
    angle_sigma: Column | None = None
    """its standard uncertainty"""
    drive: Column | None = None
    """of the pump, positive into the right chamber"""
    pumped_volume: Column | None = None
    """net volume that was pumped into the right branch"""


class AngleFile(Settings):
    """A file of its own for the angles, as cameras write it; the same separator and decimal sign."""

    file: str = Field(min_length=1)
    """beside the recording; `{stem}` stands for the recording's name without its ending"""
    time: Column
    """of the frame, on the same clock or one that is late (the latency is estimated)"""
    angle: Column
    """bend of the tip"""
    angle_sigma: Column | None = None
    """its standard uncertainty"""


class ColumnMap(Settings):
    """How to read a foreign table."""

    separator: str = Field(default=",", min_length=1, max_length=1)
    """between cells; "\\t" for tabulators"""
    decimal: Literal[".", ","] = "."
    """decimal sign"""
    skip_rows: int = Field(default=0, ge=0)
    """lines before the header"""
    header_rows: Literal[0, 1, 2] = 1
    """lines of the header: 0 none, 2 where a line of units follows the names"""
    comment: str = ""
    """lines that begin so are passed over"""
    missing: tuple[str, ...] = ("", "nan", "NaN", "NA", "N/A", "-", "--", "#N/A")
    """cells that hold no value"""
    encoding: str = "utf-8-sig"
    """of the text"""
    finger_units: int | None = Field(default=None, ge=1, le=48)
    """number of units of the finger"""
    drive_threshold: float = Field(default=0.02, ge=0, lt=1)
    """drive, as a share, below which the pump counts as standing"""
    columns: Columns
    """in the recording"""
    angles: AngleFile | None = None
    """where the angles are, if not in the recording"""

    @model_validator(mode="after")
    def _makes_sense(self) -> ColumnMap:
        if self.angles is not None and self.columns.angle is not None:
            raise ValueError("`columns.angle` and `angles` both name the angle; keep one of them")
        if self.separator == self.decimal:
            raise ValueError(f"separator and decimal sign are both {self.decimal!r}; they must differ")
        for place, table in (("columns", self.columns), ("angles", self.angles)):
            for key in type(table).model_fields if table is not None else ():
                column = getattr(table, key)
                if isinstance(column, Column):
                    _demand_known_unit(column, f"{place}.{key}", QUANTITIES.get(key, "drive"))
        return self


def _demand_known_unit(column: Column, key: str, quantity: str) -> None:
    from tubefoot.errors import ConfigError

    try:
        column.factor(quantity)
    except (ConfigError, ValueError) as error:
        raise ValueError(f"`{key}.unit`: {error}") from None


def load_column_map(path: Path | str) -> ColumnMap:
    """The column map in a TOML file.

    path : the file

    Raises ConfigError when it is missing, names an unknown unit, or leaves a needed column out.
    """
    return load_settings(path, ColumnMap)
