"""The verbs around a design file: `new`, `check` and `export`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tubefoot.cli.deck import DeckOptions
from tubefoot.errors import ConfigError, GeometryError

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign
    from tubefoot.design.judge import Judged
    from tubefoot.design.rules import Rule


def new(name: str, *, out: Path = Path()) -> None:
    """Write a commented design file to start from: every key with its meaning, unit, range and default.

    An existing file is never overwritten.

    Example: `tubefoot new my-finger` writes `my-finger.toml`.

    Parameters
    ----------
    name
        Name of the design; the file is NAME.toml.
    out
        Directory for the file.
    """
    from pydantic import ValidationError

    from tubefoot.design.template import design_template

    name = name.removesuffix(".toml")
    try:
        text = design_template(name)
    except ValidationError:
        raise ConfigError(
            f"`{name}` cannot name a design; use up to 80 letters, digits, blanks, dots, - and _, "
            "beginning with a letter or digit, and --out for the directory"
        ) from None
    path = out / f"{name}.toml"
    try:
        out.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise ConfigError(f"{path} exists and is kept; choose another name, or delete it first") from None
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}") from error
    print(f"design: {path}")


def check(design: Path, *, out: Path | None = None, pictures: bool = True) -> None:
    """Judge a design: each rule of geometry and printability with its value, its limit, pass or fail.

    The exit code is 2 where a rule is broken. Needs no CAD.

    Example: `tubefoot check examples/designs/reference-6.toml`

    Parameters
    ----------
    design
        Design file.
    out
        Directory for rules.csv, places.png and run.toml; default out/check/NAME.
    pictures
        Draw the place of every rule.
    """
    from tubefoot.design.judge import judged_file
    from tubefoot.records import Run, write_json, write_table

    judged = judged_file(design)
    settings = judged.design.model_dump() if judged.design else {}
    run = Run(out or Path("out/check") / design.stem, "check", {"design_file": design, "design": settings})
    _print_rules(judged)
    rows = [_rule_row(rule) for rule in judged.rules]
    write_table(run.path("rules.csv"), rows)
    if pictures:
        from tubefoot.design.places import write_places

        write_places(run.path("places.png"), judged.profile, judged.rules, judged.design)
    faults = judged.faults
    write_json(run.path("summary.json"), {"design": judged.name, "passed": not faults, "rules": rows})
    run.finish(passed=not faults)
    print(f"rules and pictures of the places: {run.directory}")
    if faults:
        raise GeometryError(
            f"{len(faults)} of {len(judged.rules)} rules are broken:\n"
            + "\n".join(rule.sentence for rule in faults)
        )


def export(
    design: Path,
    *,
    out: Path | None = None,
    compensate_growth: bool = False,
    pictures: bool = True,
    despite_check: Annotated[bool, Parameter(negative=())] = False,
    deck: DeckOptions | None = None,
) -> None:
    """Write the print files of a design: STEP, STL, 3MF, drawing, bill of materials, assembly instructions.

    Every mesh is closed and measured again; a design that `tubefoot check` fails is refused with the reason.

    With --fea, the input deck of another finite element program is written instead.

    Example: `tubefoot export examples/designs/reference-6.toml --compensate-growth`

    Example: `tubefoot export examples/designs/reference-3.toml --fea ccx --right-kpa 10 --left-kpa -10`

    Parameters
    ----------
    design
        Design file.
    out
        Directory for the files; default out/export/NAME.
    compensate_growth
        Move every free face inwards by printing.growth_mm, by which the printer lets it grow.
    pictures
        Draw the pictures of the instructions.
    despite_check
        Export although rules of printability are broken; they are printed.
    deck
        Options of the input deck.
    """
    if deck is not None and deck.fea is not None:
        from tubefoot.cli.deck import export_deck

        export_deck(design, out, deck)
        return
    import time

    from tubefoot.design.finger import load_design
    from tubefoot.design.judge import require_printable

    finger = load_design(design)
    try:
        require_printable(finger)
    except GeometryError as error:
        if not despite_check:
            raise
        print(f"exported despite this: {error}")
    started = time.perf_counter()

    def say(step: str) -> None:
        print(f"{time.perf_counter() - started:7.1f} s  {step}", flush=True)

    directory = out or Path("out/export") / design.stem
    about = {"design_file": design, "despite_check": despite_check}
    summary = export_design(finger, directory, compensate_growth, pictures, say, about)
    if pictures and not summary["pictures"]:
        print("no pictures: no OpenGL that works without a display was found (Debian: libosmesa6 or libegl1)")
    print(f"walls measured on the meshes differ by at most {summary['wall_error_max_mm']:.2g} mm")
    print(f"{summary['mass_g']:.2f} g, {summary['fluid_volume_finger_ml']:.2f} ml of fluid")
    print(f"print files: {directory}")


def export_design(
    finger: FingerDesign,
    directory: Path,
    compensate_growth: bool = False,
    pictures: bool = True,
    say: Callable[[str], None] = print,
    about: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write the print files of a finger as a run, and give its summary.

    finger : the design; directory : of the run; compensate_growth : move free faces inwards by the growth
    pictures : draw those of the instructions; say : told of each step; about : further settings to record

    Raises ConfigError where the CAD kernel is not installed.
    """
    from tubefoot.records import Run

    say("loading the CAD kernel")
    try:
        from tubefoot.design.export import export_finger
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"export needs {error.name}, which is not installed; install tubefoot with its `cad` extra: "
            "pip install 'tubefoot[cad]'"
        ) from error
    options = {**(about or {}), "compensate_growth": compensate_growth, "pictures": pictures}
    run = Run(directory, "export", {**options, "design": finger.model_dump()})
    growth = finger.printing.growth_mm if compensate_growth else 0.0
    exported = export_finger(finger, run.directory, growth, pictures, say)
    run.finish(files=len(exported.files))
    say("done")
    return exported.summary


def _print_rules(judged: Judged) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("rule", "value", "limit", "", title=f"{judged.name}: {len(judged.rules)} rules")
    for rule in judged.rules:
        verdict = "[green]pass[/]" if rule.passed else "[bold red]FAIL[/]"
        name = f"{rule.name} ({rule.where})" if rule.where else rule.name
        value = f"{rule.value:.3f} {rule.unit}".strip()
        table.add_row(name, value, f"{rule.sense} {rule.limit:.3g}", verdict)
    Console().print(table)


def _rule_row(rule: Rule) -> dict[str, str | float | bool | None]:
    x, z = rule.place if rule.place is not None else (None, None)
    return {
        "rule": rule.name,
        "where": rule.where,
        "value": rule.value,
        "sense": rule.sense,
        "limit": rule.limit,
        "unit": rule.unit,
        "passed": rule.passed,
        "x_mm": x,
        "z_mm": z,
        "advice": rule.advice,
    }
