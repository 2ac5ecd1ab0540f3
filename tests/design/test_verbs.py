"""`tubefoot check` and `tubefoot export` as a user calls them: files, exit codes, messages."""

import csv
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tubefoot.cli.design import check, export
from tubefoot.errors import GeometryError

EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"


def run(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", "from tubefoot.cli.main import main; main()", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


def test_check_writes_rules_places_and_the_run(tmp_path, capsys):
    check(EXAMPLES / "reference-6.toml", out=tmp_path)
    printed = capsys.readouterr().out
    assert "reference-6" in printed
    assert str(tmp_path) in printed.replace("\n", "")
    with (tmp_path / "rules.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 50
    assert {row["passed"] for row in rows} == {"true"}
    wall = next(row for row in rows if row["rule"] == "sealing width, chamber to outside")
    assert (float(wall["value"]), float(wall["limit"]), wall["unit"]) == (1.5, 1.0, "mm")
    assert 4.0 < float(wall["x_mm"]) < 11.0
    assert (tmp_path / "places.png").read_bytes().startswith(b"\x89PNG")
    recorded = tomllib.loads((tmp_path / "run.toml").read_text())
    assert recorded["run"]["verb"] == "check"
    assert recorded["run"]["passed"] is True
    assert recorded["settings"]["design"]["bellows"]["units"] == 6


def test_check_of_an_unprintable_design_shows_every_fault(tmp_path):
    design = tmp_path / "thin.toml"
    design.write_text("[bellows]\nside_wall_mm = 0.5\n")
    with pytest.raises(GeometryError, match=r"rules are broken:\nside wall is 0.5 mm, must be >= 0.6 mm"):
        check(design, out=tmp_path / "out")
    with (tmp_path / "out" / "rules.csv").open() as file:
        failed = [row["rule"] for row in csv.DictReader(file) if row["passed"] == "false"]
    assert "side wall" in failed
    assert (tmp_path / "out" / "places.png").exists()


def test_check_judges_dimensions_that_make_no_finger(tmp_path):
    design = tmp_path / "closed.toml"
    design.write_text("[bellows]\nvalley_outside_mm = 3.0\nfillet_chamber_mm = 1.5\n")
    with pytest.raises(GeometryError, match="chamber gap is 0 mm"):
        check(design, out=tmp_path / "out")
    assert (tmp_path / "out" / "places.png").exists()


def test_exit_codes(tmp_path):
    good = run("check", str(EXAMPLES / "reference-3.toml"), "--out", str(tmp_path / "a"), "--no-pictures")
    assert (good.returncode, good.stderr) == (0, "")
    bad = tmp_path / "bad.toml"
    bad.write_text("[bellows]\nside_wall_mm = 0.5\n")
    refused = run("check", str(bad), "--out", str(tmp_path / "b"), "--no-pictures")
    assert refused.returncode == 2
    assert refused.stderr.startswith("tubefoot: ")
    assert "side wall is 0.5 mm" in refused.stderr
    misspelt = tmp_path / "misspelt.toml"
    misspelt.write_text("[bellows]\nsidewall_mm = 0.5\n")
    assert "did you mean `side_wall_mm`?" in run("check", str(misspelt)).stderr


def test_check_and_new_need_no_cad():
    code = (
        "import sys; sys.modules['build123d'] = None; sys.modules['pyvista'] = None\n"
        "from tubefoot.design.judge import judged_file; from tubefoot.design.places import write_places\n"
        f"assert not judged_file(__import__('pathlib').Path({str(EXAMPLES / 'reference-3.toml')!r})).faults\n"
        "assert 'OCP' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_command_file_imports_nothing_heavy():
    code = (
        "import sys, tubefoot.cli.design\n"
        "heavy = {'numpy', 'pydantic', 'matplotlib', 'build123d', 'pyvista', 'rich'} & set(sys.modules)\n"
        "assert heavy <= {'pydantic', 'rich'}, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_export_refuses_an_unprintable_design_before_any_file(tmp_path):
    design = tmp_path / "thin.toml"
    design.write_text("[bellows]\nside_wall_mm = 0.5\n")
    with pytest.raises(GeometryError, match=r"not printable as it is:\nside wall is 0\.5 mm"):
        export(design, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_export_despite_check_compensates_and_records(tmp_path, capsys):
    design = tmp_path / "low.toml"
    design.write_text('name = "low"\n[bellows]\nunits = 1\nside_wall_mm = 0.5\n[printing]\ngrowth_mm = 0.1\n')
    export(design, out=tmp_path / "out", compensate_growth=True, pictures=False, despite_check=True)
    printed = capsys.readouterr().out
    assert "exported despite this" in printed
    assert f"print files: {tmp_path / 'out'}" in printed
    with (tmp_path / "out" / "walls.csv").open() as file:
        walls = {row["wall"]: float(row["least_mm"]) for row in csv.DictReader(file)}
    assert walls["side wall"] == pytest.approx(0.3)
    assert walls["fold wall (T1)"] == pytest.approx(1.3)
    recorded = tomllib.loads((tmp_path / "out" / "run.toml").read_text())
    assert recorded["settings"]["compensate_growth"] is True
    assert recorded["versions"]["build123d"]
    assert "moved inwards by 0.1 mm" in (tmp_path / "out" / "instructions.html").read_text()


def test_export_without_the_cad_extra_says_what_to_install(tmp_path):
    arguments = ["tubefoot", "export", str(EXAMPLES / "reference-3.toml"), "--out", str(tmp_path / "out")]
    code = (
        f"import sys; sys.modules['build123d'] = None; sys.argv = {arguments!r}\n"
        "from tubefoot.cli.main import main; main()"
    )
    refused = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "install tubefoot with its `cad` extra" in refused.stderr
    assert not (tmp_path / "out").exists()
