"""`tubefoot new`: the file holds every key of the record and reads back as the defaults."""

import re
import tomllib

import pytest
from pydantic import BaseModel

from tubefoot.cli.design import new
from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.design.template import design_template
from tubefoot.errors import ConfigError


def test_the_file_reads_back_as_the_defaults(tmp_path):
    new("mine", out=tmp_path)
    assert load_design(tmp_path / "mine.toml") == FingerDesign(name="mine")


def test_every_key_is_there_with_its_meaning():
    text = design_template("mine")
    sections = re.split(r"^\[(\w+)\]$", text, flags=re.M)
    table = {"": sections[0], **dict(zip(sections[1::2], sections[2::2], strict=True))}
    for key, field in FingerDesign.model_fields.items():
        default = field.default
        if not isinstance(default, BaseModel):
            assert f"\n{key} = " in table[""]
            continue
        for inner, inner_field in type(default).model_fields.items():
            assert inner_field.description, f"{key}.{inner} has no meaning"
            assert re.search(rf"^(# )?{inner} =", table[key], flags=re.M), f"{key}.{inner}"
            meaning = " ".join(inner_field.description.split())[:30]
            assert meaning in " ".join(table[key].replace("\n#", " ").split())


@pytest.mark.parametrize(
    ("key", "comment"),
    [
        ("units = 6", "[1 to 48]"),
        ("fold_wall_mm = 1.5", "[mm; 0.4 to 10]"),
        ("chamber_gap_mm = 3.0", "[mm; 0.3 to 30]"),
        ("# axis_mm =", "[mm; 0.5 to 60]"),
        ("bulk_modulus_mpa = 50.0", "[MPa; above 0 to 100000]"),
        ("density_g_per_cm3 = 1.145", "[g/cm3; 0.5 to 5]"),
        ("# units =", "[1 to 48]"),
    ],
)
def test_unit_and_range_stand_above_the_key(key, comment):
    lines = design_template("mine").splitlines()
    above = lines[lines.index(key) - 1]
    assert above.startswith("#")
    assert above.endswith(comment)


def test_setting_an_unset_key_works(tmp_path):
    text = design_template("mine").replace("# axis_mm =", "axis_mm = 2.5")
    assert tomllib.loads(text)["ports"]["axis_mm"] == 2.5


def test_an_existing_file_is_kept(tmp_path):
    new("mine", out=tmp_path)
    path = tmp_path / "mine.toml"
    path.write_text("# my work\n")
    with pytest.raises(ConfigError, match="exists and is kept"):
        new("mine.toml", out=tmp_path)
    assert path.read_text() == "# my work\n"


@pytest.mark.parametrize("name", ["../mine", "a/b", "", " mine", "-x", "n" * 81])
def test_a_name_that_is_no_file_name_is_refused(tmp_path, name):
    with pytest.raises(ConfigError, match="cannot name a design"):
        new(name, out=tmp_path)
    assert list(tmp_path.iterdir()) == []
