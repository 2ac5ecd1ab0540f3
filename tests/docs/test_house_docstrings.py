"""Docstrings of this house as reStructuredText, and the pages of the API."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from _house.api import page, write_pages  # noqa: E402
from _house.docstrings import restructured  # noqa: E402


def test_each_parameter_is_a_field_of_its_own():
    text = """Energy of a spring [N mm].

    With stiffness k,

        W = 1/2 k x^2

    path : file to write; its directory is made
    low, high : ends [mm],
        not equal; sign : +1 or -1

    Raises ConfigError when low > high.
    """
    lines = restructured("\n".join(line.removeprefix("    ") for line in text.split("\n"))).split("\n")
    assert lines[0] == "Energy of a spring [N mm]."
    assert "    W = 1/2 k x^2" in lines
    assert lines[lines.index("    W = 1/2 k x^2") - 2] == "::"
    assert ":param path: file to write; its directory is made" in lines
    assert ":param low: ends [mm], not equal" in lines
    assert ":param high: ends [mm], not equal" in lines
    assert ":param sign: +1 or -1" in lines
    assert "Raises ConfigError when low > high." in lines


def test_signs_mean_themselves_but_in_code():
    assert restructured("a * b, |c|, name_ and `code * here`s") == (
        "a \\* b, \\|c\\|, name\\_ and ``code * here``\\ s\n"
    )


def test_two_pieces_of_code_on_a_line_stay_two():
    assert restructured("`a.py` learns and `b.py`; x`c`") == "``a.py`` learns and ``b.py``; x\\ ``c``\n"


def test_the_command_line_s_parameters_are_fields_too():
    text = "Solve.\n\nParameters\n----------\nout\n    Directory for\n    results.\nquick\n    Coarser."
    assert restructured(text) == "Solve.\n\n:param out: Directory for results.\n:param quick: Coarser.\n"


def test_examples_stay_as_they_are():
    assert restructured("Twice.\n\n>>> 2 * 3\n6") == "Twice.\n\n>>> 2 * 3\n6\n"


def test_every_public_module_has_its_place(tmp_path):
    names = {path.name for path in write_pages(tmp_path)}
    assert {"index.rst", "tubefoot.fea.rst", "tubefoot.lab.rst"} <= names
    assert "tubefoot.cli.rst" not in names
    assert ".. automodule:: tubefoot.fea.cavity" in (tmp_path / "tubefoot.fea.rst").read_text()


def test_a_page_of_a_package_that_is_gone_goes_too(tmp_path):
    (tmp_path / "tubefoot.gone.rst").write_text("old")
    write_pages(tmp_path)
    assert not (tmp_path / "tubefoot.gone.rst").exists()


def test_private_modules_are_left_out(tmp_path):
    init = tmp_path / "__init__.py"
    init.write_text('"""About `this`."""\n')
    text = page("tubefoot.x", init, [tmp_path / "one.py"])
    assert "About ``this``." in text
    assert "tubefoot.x.one" in text


@pytest.mark.parametrize("sign", ["*args", "**kwargs"])
def test_stars_of_parameters_are_dropped(sign):
    assert restructured(f"Do.\n\n{sign} : more") == f"Do.\n\n:param {sign.strip('*')}: more\n"
