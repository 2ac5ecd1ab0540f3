"""The file of a reduced finger: there and back, versions, damage, and the one that ships."""

import numpy as np
import pytest
import tomli_w

from tubefoot.config import read_toml
from tubefoot.errors import ConfigError
from tubefoot.reduced.files import load_reduced, read_reduced, reference_file, write_reduced


def test_there_and_back_changes_nothing(tmp_path, reference):
    path = write_reduced(tmp_path / "reduced.toml", reference_file())
    again = load_reduced(path)
    angles, pressures = np.linspace(-0.05, 0.1, 12), np.array([0.02, -0.04])
    assert (
        again.respond(angles, pressures).moments.tolist()
        == reference.respond(angles, pressures).moments.tolist()
    )
    assert read_reduced(path) == reference_file()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"version": 2}, r"later Tubefoot \(layout 2, this one reads up to 1\); update"),
        ({"version": None}, "no `version`; this is not the file of a reduced finger"),
        ({"unit": 12}, "unknown key `unit`; did you mean `units`"),
        ({"units": 0}, "units"),
        (
            {"inner": {"exponents": [[2, 0, 0]], "coefficients_mj": []}},
            "1 exponent triples but 0 coefficients",
        ),
    ],
)
def test_files_that_cannot_be_used_are_refused(tmp_path, change, told):
    table = read_toml(write_reduced(tmp_path / "good.toml", reference_file())) | change
    path = tmp_path / "bad.toml"
    path.write_text(tomli_w.dumps({key: value for key, value in table.items() if value is not None}))
    with pytest.raises(ConfigError, match=told):
        load_reduced(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml: no such file"):
        load_reduced(tmp_path / "none.toml")


def test_shipped_file_says_what_it_is():
    content = reference_file()
    assert content.units == 12
    assert content.provenance["command"].startswith("tubefoot reduce")
    assert content.errors["bend_deg_max"] < 0.5
    assert content.errors["pressure_kpa_max"] < 0.5
