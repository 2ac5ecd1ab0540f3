"""`screen` and `optimise` as typed: what is refused at once, and that help names every option."""

from __future__ import annotations

from pathlib import Path

import pytest

from tubefoot.cli.screen import optimise, screen
from tubefoot.errors import ConfigError

STUDY = Path("examples/studies/walls.toml")


def test_a_comparison_without_the_claims_candidates_is_refused(tmp_path: Path) -> None:
    study = tmp_path / "half.toml"
    text = STUDY.read_text().replace("../designs", str(Path("examples/designs").resolve()))
    study.write_text("\n".join(line for line in text.splitlines() if not line.startswith("thin")))
    with pytest.raises(ConfigError, match="claim C3 is about thin, uniform, mixed; missing: thin"):
        screen(study, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_workers_of_a_foreign_cluster_cannot_be_counted(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="workers is for a local cluster"):
        screen(STUDY, out=tmp_path, scheduler="tcp://127.0.0.1:1", workers=2)
    with pytest.raises(ConfigError, match="threads"):
        screen(STUDY, out=tmp_path, threads=0)


def test_a_search_needs_ranges_and_a_sensible_number_of_designs(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="two dimensions"):
        optimise(STUDY, out=tmp_path / "out")
    with pytest.raises(ConfigError, match="allowed: 10 to 100000"):
        optimise(Path("examples/studies/space.toml"), out=tmp_path / "out", designs=3)
