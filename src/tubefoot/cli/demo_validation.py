"""The demo's validation: virtual experiments with all causes, held against the demo's own solves (C9), and
what each cause explains."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tubefoot.cli.demo_stages import Stage, Tell
    from tubefoot.study.claims import Claim

NAME = "validation"
SOLVES = {3: "reference-3", 6: "reference-6"}
BLOCKS = 16
"""Blocks of both experiments, by which progress is told."""


def validation_stages() -> list[Stage]:
    """One stage that runs two virtual experiments and compares them; the solves lie beside its directory."""
    from tubefoot.cli.demo_stages import Stage

    def run(directory: Path, tell: Tell) -> None:
        from tubefoot.records import Run
        from tubefoot.report.fit import draw_attribution
        from tubefoot.report.validation import draw_validation
        from tubefoot.validation.showcase import validate_virtual
        from tubefoot.validation.virtual_experiment import bonded_bench

        if (directory / "run.toml").exists():
            return
        steps = iter(range(1, 1000))
        solves = {units: directory.parent / name for units, name in SOLVES.items()}
        about = {
            "against": [str(path) for path in solves.values()],
            "bench": bonded_bench().model_dump(mode="json"),
        }
        record = Run(directory, "validate", about, seed=0)
        found = validate_virtual(
            directory, solves, lambda text: tell(min(next(steps) / (BLOCKS + 5), 1.0), text)
        )
        draw_validation(directory)
        draw_attribution(directory, json.loads((directory / "attribution.json").read_text(encoding="utf-8")))
        record.finish(**{claim.id: claim.verdict for claim in found.claims})

    return [Stage(NAME, 20.0, run, after=tuple(SOLVES.values()))]


def judge_validation(root: Path) -> list[Claim]:
    """C9 on the virtual experiments; C5 and C6 of the demo are those of its solves.

    root : directory of the demo's runs
    """
    from tubefoot.study.claims import Claim

    path = root / NAME / "claims.json"
    if not path.exists():
        return []
    return [Claim(**claim) for claim in json.loads(path.read_text(encoding="utf-8")) if claim["id"] == "C9"]
