import re
from html.parser import HTMLParser

import pytest
from recorded_run import record_run

from tubefoot.records import Run, write_json
from tubefoot.report import pictures
from tubefoot.report.build import write_report
from tubefoot.report.embed import inline_svg
from tubefoot.report.offscreen import NoPicture
from tubefoot.report.page import flat, number, percent, spaced_unit

CLAIMS = [
    {
        "id": "C6",
        "statement": "The angle is <linear>",
        "verdict": "refuted",
        "numbers": {"r_squared": -0.5},
        "rule": "R squared at least 0.99",
        "figure": "pressure-angle",
    }
]


class Page(HTMLParser):
    """Identifiers, links and sources of a page."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.sources = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.ids.append(attrs["id"])
        self.links += [attrs[key] for key in ("href", "xlink:href") if key in attrs]
        self.sources += [attrs["src"]] if "src" in attrs else []
        if tag == "script":
            assert "src" not in attrs


@pytest.fixture(scope="session")
def page(recorded, reversed_run, tmp_path_factory):
    """The page of two solves and a run of another verb, with claims, where no OpenGL works."""
    directory = tmp_path_factory.mktemp("report")
    other = Run(directory / "rig", "rig-check", {"port": "<sim>"})
    write_json(other.path("summary.json"), {"round_trip_ms": 2.5})
    other.finish()
    write_json(directory / "claims.json", CLAIMS)

    def no_opengl(*_):
        raise NoPicture("no OpenGL works without a display; install libosmesa6")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "draw_panels", no_opengl)
        runs = [recorded, reversed_run, other.directory]
        report = write_report(runs, directory, None, [directory], say=lambda _: None)
    return report, report.page.read_text(encoding="utf-8")


def test_the_page_needs_nothing_but_itself(page):
    _, text = page
    parsed = Page(text)
    assert all(source.startswith("data:image/webp;base64,") for source in parsed.sources)
    assert len(parsed.sources) == 1  # the cut; curves are markup
    assert set(re.findall(r"https?://[^\s\"'<)]+", text)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert "@import" not in text
    assert len(text) < 3e6


def test_every_name_is_unique_and_every_link_ends_somewhere(page):
    parsed = Page(page[1])
    assert len(parsed.ids) == len(set(parsed.ids))
    targets = [link[1:] for link in parsed.links if link.startswith("#")]
    assert "pressure-angle" in targets
    assert set(targets) <= set(parsed.ids)
    used = set(re.findall(r"url\(#([^)]+)\)", page[1]))
    assert used
    assert used <= set(parsed.ids)


def test_claims_come_first_with_verdict_number_and_rule(page):
    _, text = page
    order = [text.index(f'id="{name}"') for name in ("claims", "summary", "figures", "reasons")]
    assert order == sorted(order)
    assert "✗ refuted" in text
    assert "\u22120.5000" in text
    assert "R squared at least 0.99" in text


def test_what_others_wrote_is_text_and_never_markup(page):
    _, text = page
    assert "The angle is &lt;linear&gt;" in text
    assert "&lt;sim&gt;" in text
    assert "<sim>" not in text


def test_runs_are_compared_and_other_verbs_have_their_summary(page):
    _, text = page
    assert re.search(
        r"bend angle</th><td>deg</td>\s*<td class=\"value\">4</td>\s*<td class=\"value\">\u22124<", text
    )
    assert "solve.target" in text[text.index("What differs") :]
    assert "round trip ms" in text


def test_a_picture_that_cannot_be_drawn_is_named_with_its_reason(page):
    report, text = page
    assert report.missing == ["Pictures in space: no OpenGL works without a display; install libosmesa6."]
    assert "Not drawn. Pictures in space: no OpenGL works" in text
    keys = [path.stem for path in report.pictures]
    assert keys[0] == "section"
    assert keys[-1] == "regions"


def test_a_run_without_fields_still_has_its_curves(tmp_path):
    run = record_run(tmp_path / "bare")
    for path in (run / "fields").iterdir():
        path.unlink()
    report = write_report([run], tmp_path / "report", say=lambda _: None)
    assert report.missing == [
        "one-unit: no stress field of the last state was kept; solve it with --fields last or all."
    ]
    assert "pressure-angle" in [path.stem for path in report.pictures]
    assert 'id="claims"' not in report.page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (float("nan"), "–"),
        ("", "–"),
        (0.0, "0"),
        (35.0, "35"),
        (28098, "28\u202f098"),
        (-46.4475, "\u221246.45"),
        (0.99812, "0.9981"),
        (7.41e-5, "7.41e\u221205"),
        (True, "yes"),
        ("goal reached", "goal reached"),
    ],
)
def test_numbers_are_written_for_readers(value, text):
    assert number(value) == text


def test_differences_and_units_are_written_for_readers():
    assert percent(-0.0525) == " \u22125.2 %"
    assert percent(0.5) == " +50.0 %"
    assert [spaced_unit(unit) for unit in ("", "°", "kPa")] == ["", "°", "\u202fkPa"]


def test_settings_are_listed_on_one_level():
    assert flat({"a": {"b": 1, "c": {"d": [1, 2]}}, "e": "x"}) == {"a.b": 1, "a.c.d": "1, 2", "e": "x"}


def test_inlined_svg_keeps_its_references(tmp_path):
    path = tmp_path / "x.svg"
    path.write_text(
        '<?xml version="1.0"?><svg width="9pt" height="8pt" viewBox="0 0 9 8"><metadata>m</metadata>'
        '<defs><path id="a"/></defs><use xlink:href="#a"/><g clip-path="url(#p)"/></svg>'
    )
    text = inline_svg(path, "key", 'says "so"')
    assert text.startswith('<svg viewBox="0 0 9 8" role="img" aria-label="says &quot;so&quot;">')
    assert 'id="key-a"' in text
    assert 'xlink:href="#key-a"' in text
    assert "url(#key-p)" in text
    assert "metadata" not in text
