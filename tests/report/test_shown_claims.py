import json

import pytest

from tubefoot.errors import ConfigError
from tubefoot.report.claims import PAPER_CLAIMS, Number, load_claims


def entry(**changes):
    return {"id": "C4", "statement": "s", "verdict": "holds", "numbers": {}, "rule": "r", **changes}


def write(directory, entries):
    directory.mkdir(exist_ok=True)
    (directory / "claims.json").write_text(json.dumps(entries))
    return directory


def judged(claims):
    return [claim for claim in claims if claim.verdict != "not computed"]


def test_claims_are_shown_by_their_numbers_and_later_ones_win(tmp_path):
    one = write(tmp_path / "one", [entry(id="C10"), entry(id="C4"), entry(id="selection")])
    two = write(tmp_path / "two", [entry(verdict="refuted"), entry(id="C10", verdict="not computed")])
    claims = load_claims([one, two, tmp_path], anchors=[])
    verdicts = [(claim.id, claim.verdict) for claim in judged(claims)]
    assert verdicts == [("C4", "refuted"), ("C10", "holds"), ("selection", "holds")]


def test_those_of_the_fifteen_that_nobody_judged_are_named(tmp_path):
    claims = load_claims([write(tmp_path, [entry()])], anchors=[])
    assert [claim.id for claim in claims] == [f"C{number}" for number in range(1, 16)] == list(PAPER_CLAIMS)
    assert {claim.verdict for claim in claims if claim.id != "C4"} == {"not computed"}
    assert load_claims([tmp_path / "nothing"], anchors=[]) == []


@pytest.mark.parametrize(
    ("figure", "anchor"),
    [
        ("pressure-angle", "pressure-angle"),
        ("figures/pressure-angle.svg", "pressure-angle"),
        ("x", None),
        (None, None),
    ],
)
def test_a_claim_links_only_to_a_figure_that_is_there(tmp_path, figure, anchor):
    (claim,) = judged(load_claims([write(tmp_path, [entry(figure=figure)])], anchors={"pressure-angle"}))
    assert claim.figure == anchor


def test_nested_numbers_become_named_values(tmp_path):
    numbers = {"slope": -1.5, "per_unit": {"3": 6.0}, "angles": [1.0, 2.0]}
    (claim,) = judged(load_claims([write(tmp_path, [entry(numbers=numbers)])], anchors=[]))
    assert [(number.name, number.value) for number in claim.numbers] == [
        ("slope", -1.5),
        ("per unit 3", 6.0),
        ("angles 1", 1.0),
        ("angles 2", 2.0),
    ]
    assert [number.value for number in claim.first] == [-1.5, 6.0]


@pytest.mark.parametrize(
    ("key", "name", "unit"),
    [
        ("gain_3/15_deg_per_kpa", "gain 3/15", "°/kPa"),
        ("peeling_moment_n_mm", "peeling moment", "N mm"),
        ("largest_difference_bend_deg", "largest difference bend", "°"),
        ("opening_force_n", "opening force", "N"),
        ("accepted_states", "accepted states", ""),
        ("r_squared_3_units", "r squared 3 units", ""),
    ],
)
def test_units_are_read_from_the_ends_of_names(key, name, unit):
    assert Number.of(key, 1.0) == Number(name, 1.0, unit)


def test_an_unknown_verdict_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="verdict `maybe`; allowed: holds, refuted, mixed, not computed"):
        load_claims([write(tmp_path, [entry(verdict="maybe")])], anchors=[])


def test_a_missing_key_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="no key rule"):
        load_claims([write(tmp_path, [{"id": "C1", "verdict": "holds", "numbers": {}}])], anchors=[])
