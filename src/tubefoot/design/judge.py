"""A design file judged by every rule, also one whose dimensions make no finger."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tubefoot.config import parse_settings, read_toml
from tubefoot.design.finger import Bellows, FingerDesign, load_design
from tubefoot.design.hardware import Ports
from tubefoot.design.printability import check_rules
from tubefoot.design.profile import Profile
from tubefoot.design.rules import Rule, broken, geometry_rules
from tubefoot.errors import GeometryError


@dataclass(frozen=True)
class Judged:
    """A design's profile and all its rules; `design` is None where the dimensions make no finger."""

    name: str
    profile: Profile
    rules: list[Rule]
    design: FingerDesign | None

    @property
    def faults(self) -> list[Rule]:
        """The rules that are broken."""
        return broken(self.rules)


def judged_file(path: Path) -> Judged:
    """The design in a file with all its rules, printability only where the geometry is possible.

    path : design file

    Raises ConfigError for a file or key that cannot be used.
    """
    try:
        design = load_design(path)
    except GeometryError:
        table = read_toml(path)
        bellows = parse_settings(table.get("bellows", {}), Bellows, source=f"{path}, [bellows]")
        ports = parse_settings(table.get("ports", {}), Ports, source=f"{path}, [ports]")
        profile = Profile.of(bellows)
        return Judged(str(table.get("name", path.stem)), profile, geometry_rules(profile, ports), None)
    return Judged(design.name, design.profile, check_rules(design), design)


def require_printable(design: FingerDesign) -> None:
    """Raise GeometryError with every broken rule of a design that cannot be printed, bonded or plumbed.

    design : the finger
    """
    if faults := broken(check_rules(design)):
        raise GeometryError(
            f"design `{design.name}` is not printable as it is:\n"
            + "\n".join(rule.sentence for rule in faults)
        )
