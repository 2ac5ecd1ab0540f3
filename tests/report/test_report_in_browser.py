"""The report as a reader sees it, in headless Chromium, opened from disk."""

import io

import numpy as np
import pytest
from recorded_run import record_run

from browsing import browser, page_of, serious_findings
from tubefoot.records import Run, write_json
from tubefoot.report.build import write_report

CLAIM = {
    "id": "C6",
    "statement": "The angle is linear",
    "verdict": "refuted",
    "numbers": {"slope_deg_per_kpa": 0.25},
    "rule": "R squared at least 0.99",
    "figure": "pressure-angle",
}


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    directory = tmp_path_factory.mktemp("seen")
    runs = [record_run(directory / "one", "one"), record_run(directory / "two", "two", sign=-1.0)]
    other = Run(directory / "bend", "bend", {"target_deg": 30.0})
    write_json(other.path("summary.json"), {"settled": True, "final_error_deg": -0.4})
    other.finish()
    write_json(directory / "claims.json", [CLAIM])
    report = write_report([*runs, other.directory], directory, None, [directory], say=lambda _: None)
    return report.page.as_uri()


@pytest.fixture(scope="module")
def browsing():
    with browser() as launched:
        yield launched


def pixels(page):
    from PIL import Image

    shot = page.locator("[data-viewer=canvas]").screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def set_slider(page, value):
    page.locator("[data-viewer=state]").evaluate(
        "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }", value
    )


def test_the_finger_is_seen_and_follows_slider_and_keys(browsing, address):
    with page_of(browsing, address) as page:
        page.wait_for_selector("[data-ready=yes]")
        bent = pixels(page)
        assert (bent.min(axis=2) < 240).mean() > 0.01
        assert "one: 20.0 kPa right, −20.0 kPa left, bent by 4.0°" in page.inner_text("[data-viewer=said]")
        set_slider(page, 0)
        assert "one: 0.0 kPa right" in page.inner_text("[data-viewer=said]")
        rest = pixels(page)
        # Without stress the scale's low end is what is seen: pale yellow, no red.
        coloured = rest.max(axis=2) - rest.min(axis=2) > 20
        assert rest[coloured][:, 1].min() > 0.8 * rest[coloured][:, 0].min()
        assert (np.abs(bent - rest).max(axis=2) > 30).mean() > 0.005
        page.focus("[data-viewer=canvas]")
        page.keyboard.press("ArrowLeft")
        assert (np.abs(pixels(page) - rest).max(axis=2) > 10).mean() > 0.005


def test_two_runs_stand_side_by_side(browsing, address):
    with page_of(browsing, address) as page:
        page.wait_for_selector("[data-ready=yes]")
        page.select_option("[data-viewer=beside]", label="two")
        said = page.inner_text("[data-viewer=said]")
        assert "one: 20.0 kPa right" in said
        # The other run was pumped backwards: its state of the nearest right pressure is that at rest.
        assert "two: 0.0 kPa right" in said


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_wider_than_the_screen_and_axe_finds_nothing_serious(browsing, address, width):
    with page_of(browsing, address, width, 844) as page:
        page.wait_for_selector("[data-ready=yes]")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert serious_findings(page) == []


def test_all_fifteen_verdicts_are_on_the_first_screen(browsing, address):
    with page_of(browsing, address, 1280, 900) as page:
        rows = page.locator(".overview tbody tr")
        assert rows.count() == 15
        box = rows.nth(14).bounding_box()
        assert box["y"] + box["height"] <= 900
        row = rows.nth(5).inner_text()
        assert "C6" in row
        assert "refuted" in row
        assert "0.2500°/kPa" in row


def test_on_paper_the_picture_stands_still(browsing, address):
    with page_of(browsing, address) as page:
        page.wait_for_selector("[data-ready=yes]")
        page.emulate_media(media="print")
        assert page.locator("[data-viewer=panel]").is_hidden()
        assert page.locator("#shape .still img").is_visible()
        assert page.pdf(format="A4")[:4] == b"%PDF"


def test_without_scripts_the_still_picture_is_there(browsing, address):
    context = browsing.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(address)
    assert page.locator("#shape .still img").is_visible()
    assert page.locator("[data-viewer=panel]").is_hidden()
    context.close()
