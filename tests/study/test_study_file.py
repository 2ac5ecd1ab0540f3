"""Study files: what they accept, what they refuse and how, and the candidates that they make."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from tubefoot.config import parse_settings
from tubefoot.design.finger import FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.study.candidates import candidates_of, column_names, make_candidate, varied
from tubefoot.study.paper_claims import require_candidates
from tubefoot.study.study_file import StudyFile, load_study, number_of_candidates

WEIGHTLESS = {f"weight_{group}": 0.0 for group in ("bending", "stress", "sealing", "footprint")}
STUDIES = sorted(Path("examples/studies").glob("*.toml"))


def study(**table: object) -> StudyFile:
    return parse_settings({"vary": {"fold_run_mm": [5.0, 4.0]}, **table}, StudyFile)


@pytest.mark.parametrize("path", STUDIES, ids=[path.stem for path in STUDIES])
def test_every_example_loads_and_makes_its_candidates(path: Path) -> None:
    loaded, base = load_study(path)
    for comparison in loaded.comparison:
        require_candidates(comparison)
    first = list(itertools.islice(candidates_of(loaded, base), 9))
    assert first[0].values == {}
    assert all(FingerDesign.model_validate(one.tables) for one in first if one.comparison)


def test_the_valley_stays_put_in_the_papers_wall_comparison() -> None:
    loaded, base = load_study("examples/studies/walls.toml")
    outside = {
        one.name: FingerDesign.model_validate(one.tables).profile for one in candidates_of(loaded, base)
    }
    assert {profile.valley_outside for profile in outside.values()} == {6.0}
    assert outside["uniform"].chamber_gap == pytest.approx(6.0 - 2.0 - 1.5)
    assert (outside["thin"].fold_wall, outside["thin"].valley_wall, outside["thin"].partition) == (
        1.5,
        1.5,
        3.0,
    )


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"vary": {"fold_rum_mm": [1.0]}}, "fold_run_mm"),
        ({"vary": {"seam": {"modulus": [1.0]}}}, "seam.modulus_mpa"),
        ({"vary": {"fold_run_mm": {"low": 5.0, "high": 3.0}}}, "must be above low"),
        ({"vary": {"fold_run_mm": "wide"}}, "write numbers in a list"),
        ({"vary": {"fold_run_mm": {"low": 5.0, "hi": 3.0}}}, "low = 1.0"),
        ({"vary": {}}, "nothing to compare"),
        ({"solve": {"target": 20.0}}, "at least 35"),
        ({"solve": {"until": "bend_deg"}}, "pressure_right_kpa"),
        ({"rank": WEIGHTLESS}, "all weights are 0"),
        ({"look": {"uses": True}}, "did you mean `use`"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_by_name(table: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        study(**table)


def test_a_range_without_count_makes_no_grid_and_a_huge_grid_is_refused() -> None:
    with pytest.raises(ConfigError, match="give a count"):
        number_of_candidates(study(vary={"fold_run_mm": {"low": 3.0, "high": 5.0}}))
    wide = {"low": 1.0, "high": 2.0, "count": 1000}
    with pytest.raises(ConfigError, match="more than 10,000,000"):
        number_of_candidates(study(vary={"fold_run_mm": wide, "crest_flat_mm": wide, "partition_mm": wide}))


def test_a_grid_is_the_product_of_its_axes() -> None:
    grid = study(vary={"units": {"low": 3, "high": 5, "count": 3}, "fold_run_mm": [5.0, 4.0]})
    assert [tuple(values.values()) for values in varied(grid)] == [
        (3, 5.0), (3, 4.0), (4, 5.0), (4, 4.0), (5, 5.0), (5, 4.0),
    ]  # fmt: skip
    assert number_of_candidates(grid) == 6


def test_more_scattered_candidates_begin_with_the_same_and_fill_the_ranges() -> None:
    ranges = {"fold_run_mm": {"low": 3.0, "high": 7.0}, "units": {"low": 3, "high": 6}}
    few = list(varied(study(vary=ranges, sample={"count": 50})))
    many = list(varied(study(vary=ranges, sample={"count": 1100})))
    assert many[:50] == few
    assert len(many) == 1100
    runs = np.array([values["bellows.fold_run_mm"] for values in many])
    assert 3.0 <= runs.min() < 3.05 < 6.95 < runs.max() <= 7.0
    assert {values["bellows.units"] for values in many} == {3, 4, 5, 6}


def test_a_candidate_is_known_by_its_design_and_solve_not_by_its_name() -> None:
    base, solve = FingerDesign(), SolveSettings(fields="none")
    one = make_candidate(base, "one", {"bellows.fold_run_mm": 4.0})
    same = make_candidate(base.model_copy(update={"name": "other"}), "two", {"bellows.fold_run_mm": 4})
    other = make_candidate(base, "one", {"bellows.fold_run_mm": 4.1})
    assert one.key(solve) == same.key(solve)
    assert len({one.key(solve), other.key(solve), one.key(SolveSettings(fields="none", states=9))}) == 3


def test_columns_bear_the_table_only_where_names_clash() -> None:
    names = column_names(
        study(vary={"fold_run_mm": [1.0], "seam": {"thickness_mm": [0.1]}, "base": {"plate_mm": [4.0]}})
    )
    assert names["seam.thickness_mm"] == "thickness_mm"


def test_a_fault_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "typo.toml"
    path.write_text("[vary]\nfold_rum_mm = [1.0]\n")
    with pytest.raises(
        ConfigError, match=r"typo\.toml: `fold_rum_mm` is no dimension .* `bellows\.fold_run_mm`"
    ):
        load_study(path)


def test_a_claim_needs_its_candidates() -> None:
    one = study(
        comparison=[{"name": "walls", "claims": ["C3"], "candidates": {"thin": {"fold_wall_mm": 1.5}}}]
    )
    with pytest.raises(ConfigError, match="missing: uniform, mixed"):
        require_candidates(one.comparison[0])
