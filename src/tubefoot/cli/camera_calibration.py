"""The verb `calibrate-camera`: sheets to print, a rehearsal; lens, bending plane and zero from pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App

from tubefoot.cli.progress import with_progress
from tubefoot.errors import ConfigError

if TYPE_CHECKING:
    from tubefoot.vision.board import Board
    from tubefoot.vision.calibration import CameraCalibration
    from tubefoot.vision.layout import MarkerLayout
    from tubefoot.vision.views import BoardView, LensCalibration

VIEWS_FOLDER = "views"
PLANE_FILE = "plane.png"
NEUTRAL_FOLDER = "neutral"
BENDING_FOLDER = "bending"
MOST_FRAMES = 100_000

camera_app = App(
    name="calibrate-camera",
    help="Calibrate the camera: lens, bending plane and neutral zero, from pictures of a printed board.\n\n"
    "Print the board and the markers, take the pictures (or `rehearse` them), calibrate, then "
    "`tubefoot track`.",
)


@camera_app.command(name="print")
def print_sheets(
    layout: Path | None = None,
    *,
    out: Path = Path("out/sheets"),
    paper: str = "a4",
    squares_x: int = 7,
    squares_y: int = 9,
    square_mm: float = 20.0,
) -> None:
    """Print sheets at true scale: the ChArUco board and the finger's markers, each as PDF and SVG.

    Example: `tubefoot calibrate-camera print examples/vision/finger-12.toml --out out/sheets`

    Parameters
    ----------
    layout
        Marker layout of the finger (TOML); the 12-unit reference finger's if not given.
    out
        Directory for the sheets.
    paper
        a4, a3 or letter.
    squares_x
        Squares of the board across.
    squares_y
        Squares of the board up.
    square_mm
        Side of a square of the board [mm].
    """
    from tubefoot.records import Run
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.sheets import board_sheet, marker_sheet

    board = _board(squares_x, squares_y, square_mm)
    markers = chosen_layout(layout)
    sheets = {"board": board_sheet(board, paper), "markers": marker_sheet(markers, paper)}
    run = Run(
        out,
        "calibrate-camera print",
        {"layout": str(layout or "reference"), "paper": paper, **_board_table(board)},
    )
    for name, sheet in sheets.items():
        for path in sheet.save(run.path(name)):
            print(f"{name}: {path}")
    run.finish()
    print("Print at 100 % and check the 100 mm bar with a ruler.")


@camera_app.command
def rehearse(
    layout: Path | None = None,
    *,
    out: Path = Path("out/rehearsal"),
    views: int = 18,
    frames: int = 90,
    bend_deg: float = 60.0,
    seed: int = 0,
) -> None:
    """Draw the pictures that a user would take, with known truth, to try everything without a camera.

    Writes views/ of the board, plane.png with the board in the bending plane, neutral/ of the straight
    finger, bending/ with a bending finger, and truth.csv with its true angles.

    Example: `tubefoot calibrate-camera rehearse --out out/rehearsal`

    Parameters
    ----------
    layout
        Marker layout of the finger (TOML); the 12-unit reference finger's if not given.
    out
        Directory for the pictures.
    views
        Pictures of the board.
    frames
        Pictures of the bending finger.
    bend_deg
        Largest bending angle of the tip [deg].
    seed
        Seed of the noise and of the board's poses.
    """
    import numpy as np

    from tubefoot.records import Run, write_table
    from tubefoot.units import DEG
    from tubefoot.vision.board import Board
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.rehearsal import Rehearsal, even_bend

    if views < 1 or frames < 1 or not abs(bend_deg) <= 120:
        raise ConfigError("rehearse needs --views >= 1, --frames >= 1 and --bend-deg between -120 and 120")
    markers = chosen_layout(layout)
    run = Run(
        out, "calibrate-camera rehearse", {"layout": str(layout or "reference"), "bend_deg": bend_deg}, seed
    )
    rehearsal = Rehearsal(markers, seed=seed)
    board = Board()
    for index, picture in enumerate(with_progress(rehearsal.board_views(board, views), "board views", views)):
        _write_image(run.path(f"{VIEWS_FOLDER}/view_{index:03d}.png"), picture)
    _write_image(run.path(PLANE_FILE), rehearsal.plane_view(board))
    for index in range(5):
        picture = rehearsal.frame(even_bend(markers, 0.0))
        _write_image(run.path(f"{NEUTRAL_FOLDER}/neutral_{index}.png"), picture)
    truth = []
    heights = np.array([0.0, markers.length_mm / 2, markers.length_mm, markers.markers[-1].z_mm])
    for index in with_progress(range(frames), "bending frames", frames):
        phase = 2 * np.pi * index / frames
        shape = even_bend(markers, bend_deg * DEG * np.sin(phase))
        _write_image(run.path(f"{BENDING_FOLDER}/frame_{index:04d}.png"), rehearsal.frame(shape))
        base, middle, tip, marker = shape(heights)[1] / DEG
        truth.append(
            {
                "frame": index,
                "time_s": index / 30,
                "bend_deg": float(marker),
                "theta1_deg": float(middle - base),
                "theta2_deg": float(tip - middle),
            }
        )
    write_table(run.path("truth.csv"), truth)
    run.finish()
    print(f"pictures: {run.directory}")
    given = f" --layout {layout}" if layout else ""
    print(f"next: tubefoot calibrate-camera {run.path(VIEWS_FOLDER)} --plane-view {run.path(PLANE_FILE)} \\")
    print(f"        --neutral {run.path(NEUTRAL_FOLDER)}{given} --out {run.path('camera')}")
    print(f"then: tubefoot track {run.path(BENDING_FOLDER)}{given} \\")
    print(f"        --camera {run.path('camera')}/camera.toml --out {run.path('track')}")


@camera_app.default
def calibrate(
    source: str,
    *,
    plane_view: str = "",
    neutral: str = "",
    layout: Path | None = None,
    out: Path = Path("out/camera"),
    squares_x: int = 7,
    squares_y: int = 9,
    square_mm: float = 20.0,
    width_px: int = 640,
    height_px: int = 480,
    live_views: int = 24,
    line_time_us: float = 0.0,
) -> None:
    """Calibrate: lens from views of the board, plane from one view, zero from the straight finger.

    Writes camera.toml, which `tubefoot track` reads, summary.json with the verdict, and calibration.png
    with coverage and residuals. The plane's frame is that of the board, or of the finger's base once
    --neutral was given.

    Example: `tubefoot calibrate-camera out/rehearsal/views --plane-view out/rehearsal/plane.png
    --neutral out/rehearsal/neutral --out out/rehearsal/camera` (after `tubefoot calibrate-camera rehearse`)

    Parameters
    ----------
    source
        Folder of board views, video of them, or a webcam (0, /dev/video0): move the board about before it.
    plane_view
        Picture of the board held in the bending plane, its upper edge up; the last view if not given.
    neutral
        Picture, folder or video of the straight finger; sets the zero.
    layout
        Marker layout of the finger (TOML); the 12-unit reference finger's if not given.
    out
        Directory for the result.
    squares_x
        Squares of the board across.
    squares_y
        Squares of the board up.
    square_mm
        Measured side of a square of the printed board [mm].
    width_px
        Width that a webcam is asked for [px].
    height_px
        Height that a webcam is asked for [px].
    live_views
        Views to take from a webcam or a video, each one elsewhere than those before.
    line_time_us
        Row delay of a rolling shutter [us], from the camera's data sheet; corrects angles in motion.
    """
    from tubefoot.records import Run, write_json
    from tubefoot.vision.calibration import CameraCalibration
    from tubefoot.vision.calibration_picture import draw_calibration
    from tubefoot.vision.chosen_pictures import board_views, frames_of
    from tubefoot.vision.layout import chosen_layout
    from tubefoot.vision.sources import open_source
    from tubefoot.vision.views import calibrate_lens, gather_views, plane_of_view

    board = _board(squares_x, squares_y, square_mm)
    camera = open_source(source, (width_px, height_px))
    markers = chosen_layout(layout) if neutral else None
    settings = {"source": source, "plane_view": plane_view, "neutral": neutral, **_board_table(board)}
    run = Run(out, "calibrate-camera", settings)
    with camera:
        many = live_views if not Path(source).is_dir() else 0
        frames = with_progress(frames_of(camera, MOST_FRAMES), "pictures", None)
        views, dropped, size = gather_views(board_views(frames, board, many), board)
    found = calibrate_lens(views, board, size, dropped)
    last = _plane_view(plane_view, board, size) if plane_view else views[-1]
    plane, tilt_sigma = plane_of_view(last, board, found.lens)
    calibration = CameraCalibration.of(found.lens, plane, tilt_sigma, found.residual_px)
    calibration = calibration.model_copy(update={"line_time_us": line_time_us})
    if markers is not None:
        calibration = _set_zero(calibration, markers, neutral)
    calibration.save(run.path("camera.toml"))
    draw_calibration(found, size, run.path("calibration.png"))
    faults = found.faults()
    write_json(run.path("summary.json"), _calibration_summary(found, calibration, faults))
    run.finish()
    _print_verdict(found, calibration, faults)
    print(f"camera: {run.path('camera.toml')}")


def _set_zero(calibration: CameraCalibration, markers: MarkerLayout, neutral: str) -> CameraCalibration:
    from tubefoot.vision.chosen_pictures import readings_at_rest
    from tubefoot.vision.plane import PlaneMap
    from tubefoot.vision.tracker import MarkerTracker, averaged

    tracker = MarkerTracker(PlaneMap(calibration.to_lens(), calibration.to_plane()), markers)
    return calibration.zeroed_by(averaged(readings_at_rest(Path(neutral), tracker)), markers)


def _plane_view(source: str, board: Board, size: tuple[int, int]) -> BoardView:
    """The view that shows the board in the bending plane; raises ConfigError for one that cannot be used."""
    from tubefoot.vision.chosen_pictures import FEWEST_CORNERS, one_picture
    from tubefoot.vision.views import BoardView

    picture = one_picture(source)
    if picture.shape[1::-1] != size:
        raise ConfigError(f"{source} is {picture.shape[1]} x {picture.shape[0]} px, the views {size}")
    ids, pixels = board.find(picture)
    if len(ids) < FEWEST_CORNERS:
        raise ConfigError(
            f"{source} shows {len(ids)} corners of the board, at least {FEWEST_CORNERS} are needed"
        )
    return BoardView(source, ids, pixels)


def _board(squares_x: int, squares_y: int, square_mm: float) -> Board:
    from tubefoot.config import parse_settings
    from tubefoot.vision.board import Board, BoardSettings

    table = {"squares_x": squares_x, "squares_y": squares_y, "square_mm": square_mm}
    return Board(parse_settings(table, BoardSettings, source="the board"))


def _board_table(board: Board) -> dict[str, Any]:
    return {"board": board.settings.model_dump()}


def _calibration_summary(
    found: LensCalibration, calibration: CameraCalibration, faults: list[str]
) -> dict[str, Any]:
    return {
        "good": not faults,
        "faults": faults,
        "views": len(found.views),
        "dropped": found.dropped,
        "residual_px": found.residual_px,
        "coverage": found.coverage,
        "tilt_span_deg": found.tilt_span_deg,
        "focal_relative_sigma": found.focal_sigma,
        "plane_tilt_sigma_deg": calibration.plane.tilt_sigma_deg,
        "zeroed": calibration.zeroed,
    }


def _print_verdict(found: LensCalibration, calibration: CameraCalibration, faults: list[str]) -> None:
    print(f"views used      {len(found.views)} (without a board: {len(found.dropped)})")
    print(f"residual        {found.residual_px:.3f} px")
    print(f"coverage        {found.coverage:.0%} of the picture")
    print(f"largest tilt    {found.tilt_span_deg:.0f} deg")
    print(f"focal length    {found.lens.focal_x:.1f} px, uncertain by {found.focal_sigma:.2%}")
    print(f"plane tilt      uncertain by {calibration.plane.tilt_sigma_deg:.3f} deg")
    print(f"neutral zero    {'set' if calibration.zeroed else 'not set: give --neutral'}")
    print("verdict         good" if not faults else "verdict         NOT good")
    for fault in faults:
        print(f"  - {fault}")


def _write_image(path: Path, picture: Any) -> None:
    import cv2

    from tubefoot.records import write_whole

    write_whole(path, cv2.imencode(".png", picture)[1].tobytes())
