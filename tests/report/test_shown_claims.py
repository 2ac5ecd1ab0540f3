import json

import pytest

from tubefoot.errors import ConfigError
from tubefoot.report.claims import load_claims


def entry(**changes):
    return {"id": "C4", "statement": "s", "verdict": "holds", "numbers": {}, "rule": "r", **changes}


def write(directory, entries):
    directory.mkdir(exist_ok=True)
    (directory / "claims.json").write_text(json.dumps(entries))
    return directory


def test_claims_are_shown_by_their_numbers_and_later_ones_win(tmp_path):
    one = write(tmp_path / "one", [entry(id="C10"), entry(id="C4")])
    two = write(tmp_path / "two", [entry(verdict="refuted")])
    claims = load_claims([one, two, tmp_path], anchors=[])
    assert [(claim.id, claim.verdict) for claim in claims] == [("C4", "refuted"), ("C10", "holds")]


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
    (claim,) = load_claims([write(tmp_path, [entry(figure=figure)])], anchors={"pressure-angle"})
    assert claim.figure == anchor


def test_nested_numbers_become_named_values(tmp_path):
    numbers = {"slope": -1.5, "per_unit": {"3": 6.0}, "angles": [1.0, 2.0]}
    (claim,) = load_claims([write(tmp_path, [entry(numbers=numbers)])], anchors=[])
    assert claim.numbers == [("slope", -1.5), ("per_unit 3", 6.0), ("angles 1", 1.0), ("angles 2", 2.0)]


def test_an_unknown_verdict_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="verdict `maybe`; allowed: holds, refuted, mixed, not computed"):
        load_claims([write(tmp_path, [entry(verdict="maybe")])], anchors=[])


def test_a_missing_key_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="no key rule"):
        load_claims([write(tmp_path, [{"id": "C1", "verdict": "holds", "numbers": {}}])], anchors=[])
