"""Malformed and impossible design files: each is refused with value, limit and what to change."""

import pytest

from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.errors import ConfigError, GeometryError

MALFORMED = {
    "not toml": ("[bellows\nunits = 3", ["not valid TOML"]),
    "unknown section": ("[bellow]\nunits = 3", ["unknown key `bellow`", "did you mean `bellows`?"]),
    "misspelt key": (
        "[bellows]\nfold_wal_mm = 1.5",
        ["unknown key `bellows.fold_wal_mm`", "did you mean `fold_wall_mm`?"],
    ),
    "key without its unit": ("[bellows]\nheight = 9", ["`bellows.height`", "did you mean `height_mm`?"]),
    "text for a length": ('[bellows]\nheight_mm = "tall"', ["`bellows.height_mm` = 'tall'", "number"]),
    "half a unit": ("[bellows]\nunits = 2.5", ["`bellows.units` = 2.5", "integer"]),
    "no unit": ("[bellows]\nunits = 0", ["`bellows.units` = 0", "(allowed: 1 to 48)"]),
    "too many units": ("[bellows]\nunits = 49", ["`bellows.units` = 49", "(allowed: 1 to 48)"]),
    "negative wall": ("[bellows]\nfold_wall_mm = -1.5", ["`bellows.fold_wall_mm` = -1.5", "0.4 to 10"]),
    "endless run": ("[bellows]\nfold_run_mm = inf", ["`bellows.fold_run_mm` = inf", "finite"]),
    "not a number": ("[bellows]\npartition_mm = nan", ["`bellows.partition_mm`", "finite"]),
    "two widths": (
        "[bellows]\nchamber_gap_mm = 3.0\nvalley_outside_mm = 6.0",
        ["chamber_gap_mm = 3", "valley_outside_mm = 6", "give one of them"],
    ),
    "section instead of a number": ("[bellows.units]\nn = 3", ["`bellows.units`", "integer"]),
    "name with a slash": ('name = "../finger"', ["`name` = '../finger'", "pattern"]),
    "empty name": ('name = ""', ["`name` = ''"]),
    "moduli without exponents": ("[body]\nmu_mpa = [0.2, 0.1]\nalpha = [1.3]", ["2 moduli", "1 exponents"]),
    "softening body": ("[body]\nmu_mpa = [-0.2]\nalpha = [1.3]", ["shear modulus", "-0.2 MPa", "signs"]),
    "exponent zero": ("[body]\nmu_mpa = [0.2]\nalpha = [0.0]", ["exponent alpha is 0"]),
    "compressible body": ("[body]\nbulk_modulus_mpa = 1.0", ["bulk modulus 1 MPa", "raise bulk_modulus_mpa"]),
    "incompressible tubes": ("[rigid]\npoisson_ratio = 0.5", ["`rigid.poisson_ratio` = 0.5", "0 to 0.495"]),
    "marker on unit zero": ("[marker_seats]\nunits = [0]", ["`marker_seats.units.0` = 0"]),
    "hose without a wall": (
        "[ports]\nhose_bore_mm = 6.0\nhose_outer_mm = 5.0",
        ["`ports`", "hose_outer_mm = 5 leaves no wall around hose_bore_mm = 6", "raise hose_outer_mm"],
    ),
    "two keys alike": ("[bellows]\nunits = 3\nunits = 4", ["not valid TOML"]),
}

IMPOSSIBLE = {
    "walls fill the chamber": (
        "[bellows]\nvalley_outside_mm = 3.0",
        ["chamber gap is 0 mm, must be >= 0.3 mm", "raise bellows.valley_outside_mm"],
    ),
    "side walls fill the height": (
        "[bellows]\nheight_mm = 3.0\n[ports]\nouter_diameter_mm = 2.6",
        ["chamber height is 0 mm, must be >= 0.5 mm", "raise bellows.height_mm"],
    ),
    "fold wall as deep as the fold": (
        "[bellows]\nfold_run_mm = 1.5\nfold_rise_mm = 0.2",
        ["fold slot depth is 0 mm, must be >= 0.3 mm", "raise bellows.fold_run_mm"],
    ),
    "flanks meet in the slot": (
        "[bellows]\ncrest_flat_mm = 2.5",
        ["fold slot width (at the crest) is 0.04059 mm, must be >= 0.3 mm", "raise bellows.crest_flat_mm"],
    ),
    "slots meet under the valley": (
        "[bellows]\nfold_rise_mm = 3.0\nvalley_flat_mm = 0.4\nfold_wall_mm = 0.6\nvalley_wall_mm = 3.0",
        ["valley between slots (chamber side)", "must be >= 0.4 mm", "raise bellows.valley_flat_mm"],
    ),
    "fillet wider than the crest": (
        "[bellows]\nfillet_outside_mm = 2.0",
        ["outside fillet is 2 mm, must be <=", "reduce bellows.fillet_outside_mm"],
    ),
    "fillet wider than the slot": (
        "[bellows]\nfillet_chamber_mm = 1.5",
        ["chamber fillet is 1.5 mm, must be <=", "reduce bellows.fillet_chamber_mm"],
    ),
    "bore wider than the chamber": (
        "[ports]\nbore_mm = 3.2\nouter_diameter_mm = 4.6",
        ["port bore is 3.2 mm, must be <= 3 mm", "reduce ports.bore_mm"],
    ),
    "tube without a wall": (
        "[ports]\nouter_diameter_mm = 2.2",
        ["port tube wall is 0.1 mm, must be >= 0.3 mm", "raise ports.outer_diameter_mm"],
    ),
    "tubes that meet": (
        "[ports]\nouter_diameter_mm = 5.8",
        ["port tube diameter (between the tubes) is 5.8 mm", "would meet"],
    ),
    "tube out of the flank": (
        "[ports]\naxis_mm = 3.0\nouter_diameter_mm = 6.2",
        ["port tube, outermost is 6.1 mm, must be <= 6 mm", "stand out of the cap"],
    ),
    "bore in the partition": (
        "[ports]\naxis_mm = 1.5",
        ["port bore, distance to the chamber's walls is -0.5 mm", "leave ports.axis_mm out"],
    ),
    "tube higher than the finger": (
        "[bellows]\nheight_mm = 5.0\nvalley_outside_mm = 20.0\n[ports]\nouter_diameter_mm = 5.5",
        ["port tube diameter (across the finger) is 5.5 mm, must be <= 5 mm", "raise bellows.height_mm"],
    ),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_a_malformed_design_names_the_fault(tmp_path, case):
    text, expected = MALFORMED[case]
    _assert_refused(tmp_path, text, expected, ConfigError)


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_an_impossible_design_says_value_limit_and_remedy(tmp_path, case):
    text, expected = IMPOSSIBLE[case]
    _assert_refused(tmp_path, text, expected, GeometryError)


def test_a_missing_design_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"absent\.toml: no such file"):
        load_design(tmp_path / "absent.toml")


def test_a_directory_is_no_design(tmp_path):
    with pytest.raises(ConfigError, match="is a directory; name a TOML file"):
        load_design(tmp_path)


def test_bytes_are_no_design(tmp_path):
    path = tmp_path / "design.toml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ConfigError, match="cannot be read as text"):
        load_design(path)


def test_all_broken_rules_are_told_at_once():
    with pytest.raises(GeometryError) as caught:
        FingerDesign.model_validate(
            {"bellows": {"valley_outside_mm": 3.0}, "ports": {"outer_diameter_mm": 2.2}}
        )
    assert str(caught.value).count("must be") >= 3


def _assert_refused(tmp_path, text, expected, kind):
    path = tmp_path / "design.toml"
    path.write_text(text)
    with pytest.raises(kind) as caught:
        load_design(path)
    message = str(caught.value)
    assert str(path) in message
    for part in expected:
        assert part in message, message
