"""All pictures of a set of runs; what cannot be drawn here is named with its reason instead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tubefoot.errors import ConfigError
from tubefoot.report.bends import draw_bends
from tubefoot.report.curves import draw_curves
from tubefoot.report.kept import kept_pictures
from tubefoot.report.look import Picture
from tubefoot.report.offscreen import NoPicture
from tubefoot.report.regions import draw_regions
from tubefoot.report.runs import RunRecord, load_run
from tubefoot.report.scale import ColourScale
from tubefoot.report.scene import read_shape, scene_of
from tubefoot.report.seam import draw_seam
from tubefoot.report.section import draw_section
from tubefoot.report.solids import VON_MISES, draw_panels
from tubefoot.report.surface import Surface, read_surface
from tubefoot.report.time_course import draw_time_courses

Say = Callable[[str], None]


@dataclass
class Gallery:
    """The pictures that were drawn, a sentence for each that was not, and the scene of the page's viewer."""

    pictures: list[Picture] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    scene: dict[str, Any] | None = None

    @property
    def keys(self) -> set[str]:
        """Anchors of the pictures."""
        return {picture.key for picture in self.pictures}


def draw_pictures(runs: Sequence[RunRecord], directory: Path, say: Say = print) -> Gallery:
    """The pictures of runs, several runs side by side in each.

    runs : runs in the order in which they are shown; directory : where the files go; say : told of each step
    """
    gallery = Gallery()
    solves = [run for run in runs if run.is_solve]
    if solves:
        _draw_solves(solves, directory, gallery, say)
    others = [run for run in runs if not run.is_solve]
    if (bends := draw_bends(others, directory)) is not None:
        gallery.pictures.append(bends)
    gallery.pictures += kept_pictures(others, gallery.keys)
    return gallery


def gather_scene(runs: Sequence[RunRecord], gallery: Gallery) -> None:
    """Give a gallery the scene of all solves whose stress fields were kept; none where there is none.

    runs : runs in the order in which they are shown
    gallery : gets the scene, and the reason why a run is not in it
    """
    shapes = []
    for run in runs:
        try:
            shape = read_shape(run)
        except ConfigError as error:
            gallery.missing.append(f"{run.name} in space: {error}.")
            continue
        if shape is not None:
            shapes.append((run, shape))
    gallery.scene = scene_of(shapes) if shapes else None


def _draw_solves(solves: Sequence[RunRecord], directory: Path, gallery: Gallery, say: Say) -> None:
    surfaces = _surfaces(solves, gallery)
    shapes: list[Picture] = []
    if surfaces:
        say("stressed shapes")
        try:
            shapes = draw_panels(surfaces, directory)
        except NoPicture as reason:
            gallery.missing.append(f"Pictures in space: {reason}.")
    gallery.pictures += shapes[:1]
    halves = [(run, surface) for run, surface in surfaces if surface.is_half]
    if halves:
        say("cut at the mid-plane")
        cuts = [surface.cut() for _, surface in halves]
        scale = ColourScale.of("von_mises_kpa", VON_MISES, cuts, signed=False)
        gallery.pictures.append(draw_section(halves, directory, scale))
        if (seam := draw_seam(halves, directory)) is not None:
            gallery.pictures.append(seam)
    gallery.pictures += draw_curves(solves, directory, say)
    if (course := draw_time_courses(solves, directory)) is not None:
        gallery.pictures.append(course)
    gallery.pictures += shapes[1:]
    if (regions := draw_regions(solves, directory)) is not None:
        gallery.pictures.append(regions)


def draw_solve_pictures(directory: Path, say: Say = print) -> list[Path]:
    """The PNG files of one solve, drawn into `pictures/` of its directory.

    directory : of the solve; say : told of pictures that cannot be drawn, and why
    """
    gallery = draw_pictures([load_run(directory)], directory / "pictures", say=lambda _: None)
    for reason in gallery.missing:
        say(reason)
    return [picture.png for picture in gallery.pictures]


def _surfaces(runs: Sequence[RunRecord], gallery: Gallery) -> list[tuple[RunRecord, Surface]]:
    found = []
    for run in runs:
        path = run.last_fields
        if path is None:
            gallery.missing.append(
                f"{run.name}: no stress field of the last state was kept; solve it with --fields last or all."
            )
            continue
        try:
            found.append((run, read_surface(path)))
        except ConfigError as error:
            gallery.missing.append(f"{run.name}: {error}.")
    return found
