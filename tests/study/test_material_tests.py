"""Tables of any making become stretches and MPa, or a clear error; a fitted material solves in a design."""

import json

import numpy as np
import pytest

from tubefoot.design.finger import load_design
from tubefoot.errors import ConfigError
from tubefoot.study.material_fit import MaterialFitSettings, fit_material
from tubefoot.study.material_tests import load_material_tests
from tubefoot.study.ogden_curves import nominal_stress

STRETCH = np.linspace(1.0, 2.0, 11)
STRESS = nominal_stress("uniaxial", STRETCH, [0.3], [2.0])


def written(path, header, *columns, above="", separator=",", comma=False):
    rows = [separator.join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True)]
    text = above + header + "\n" + "\n".join(rows) + "\n"
    path.write_text(text.replace(".", ",") if comma else text)
    return path


@pytest.mark.parametrize(
    ("header", "deformation", "stress"),
    [
        ("stretch,stress_mpa", STRETCH, STRESS),
        ("strain_percent,stress_kpa", 100 * (STRETCH - 1), 1e3 * STRESS),
        ("Strain [%],Stress [psi]", 100 * (STRETCH - 1), STRESS / 6.894757293168e-3),
        ("true strain,true stress (N/mm2)", np.log(STRETCH), STRESS * STRETCH),
    ],
)
def test_headers_say_measure_and_unit(tmp_path, header, deformation, stress):
    path = written(tmp_path / "a.csv", header, deformation, stress, above="# kind: uniaxial\n")
    (test,) = load_material_tests([path])
    assert test.kind == "uniaxial"
    assert test.deformation == pytest.approx(STRETCH, rel=1e-8)
    assert test.stress == pytest.approx(STRESS, rel=1e-8, abs=1e-12)


def test_a_foreign_table_is_described(tmp_path):
    written(
        tmp_path / "b.txt", "Dehnung;Spannung", 100 * (STRETCH - 1), 10 * STRESS, separator=";", comma=True
    )
    (tmp_path / "b.toml").write_text(
        '[[test]]\nfile = "b.txt"\nkind = "uniaxial"\nseparator = ";"\ndecimal = ","\n'
        'deformation = { column = "Dehnung", unit = "%" }\nstress = { column = "Spannung", unit = "bar" }\n'
    )
    (test,) = load_material_tests([tmp_path / "b.toml"])
    assert test.deformation == pytest.approx(STRETCH)
    assert test.stress == pytest.approx(STRESS, rel=1e-8)


def test_shear_moduli_are_tripled_and_angular_frequencies_turned(tmp_path):
    path = written(
        tmp_path / "c.csv", "f (rad/s),G' (kPa),G'' (kPa)", [1.0, 10.0, 100.0], [100] * 3, [10] * 3
    )
    (test,) = load_material_tests([path])
    assert test.frequency == pytest.approx(np.array([1, 10, 100]) / (2 * np.pi))
    assert test.storage == pytest.approx([0.3] * 3)


def test_relaxation_of_a_stress_is_divided_by_its_strain(tmp_path):
    path = written(
        tmp_path / "d.csv", "time_ms,stress_kpa", [0, 100, 1000], [20, 10, 5], above="# strain: 0.05\n"
    )
    (test,) = load_material_tests([path])
    assert test.time == pytest.approx([0, 0.1, 1.0])
    assert test.modulus == pytest.approx([0.4, 0.2, 0.1])


@pytest.mark.parametrize(
    ("header", "above", "words"),
    [
        ("strain,stress_kpa", "", "which test is it"),
        ("strain,stress [Mpaa]", "# kind: uniaxial\n", "did you mean `MPa`"),
        ("strain,stress", "# kind: uniaxial\n", "not a unit of stress"),
        ("strain,force_n", "# kind: uniaxial\n", "needs `stress`"),
        ("strain,stress_kpa", "# kind: sideways\n", "kind"),
        ("strain,stress_kpa", "# kind: dma\n", "needs `frequency`"),
    ],
)
def test_what_cannot_be_read_is_said(tmp_path, header, above, words):
    path = written(tmp_path / "e.csv", header, [0.0, 0.1, 0.2], [0.0, 1.0, 2.0], above=above)
    with pytest.raises(ConfigError, match=words):
        load_material_tests([path])


def test_a_wrong_unit_of_strain_is_noticed(tmp_path):
    path = written(tmp_path / "f.csv", "strain,stress_kpa", [0, 50, 100], [0, 1, 2], above="# kind: planar\n")
    with pytest.raises(ConfigError, match="check that `strain` is the measure"):
        load_material_tests([path])


def test_a_fitted_material_is_used_by_a_design(tmp_path):
    curve = written(tmp_path / "g.csv", "stretch,stress_mpa", STRETCH, STRESS, above="# kind: uniaxial\n")
    time = np.logspace(-1, 3, 25)
    slow = written(tmp_path / "h.csv", "time_s,modulus_mpa", time, 0.9 * (1 + 0.5 * np.exp(-time / 10)))
    fit = fit_material(
        load_material_tests([curve, slow]), tmp_path / "out", MaterialFitSettings(name="soft", terms=1)
    )
    (tmp_path / "design.toml").write_text('[body]\nmaterial_file = "out/material.toml"\nscale = 0.8\n')
    body = load_design(tmp_path / "design.toml").body
    assert body.name == "soft"
    assert body.mu_mpa == pytest.approx((0.3,), rel=1e-4)
    assert body.scale == 0.8
    decay = sum(
        share * np.exp(-5 / tau)
        for tau, share in zip(body.relaxation_time_s, body.relaxation_share, strict=True)
    )
    assert decay == pytest.approx(0.5 * np.exp(-0.5), rel=5e-3)
    record = json.loads((tmp_path / "out/fit.json").read_text())
    assert record["conventions"]["classic"] == pytest.approx([0.3], rel=1e-4)
    assert fit.prony is not None
    assert record["prony"]["long_term_mpa"] == pytest.approx(0.9, rel=1e-3)


def test_a_material_file_without_a_body_is_refused(tmp_path):
    (tmp_path / "m.toml").write_text("x = 1\n")
    (tmp_path / "d.toml").write_text('[body]\nmaterial_file = "m.toml"\n')
    with pytest.raises(ConfigError, match="no table"):
        load_design(tmp_path / "d.toml")
