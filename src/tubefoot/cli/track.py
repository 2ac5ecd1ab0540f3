"""The verb `track`: bending angle, theta1 and theta2 from a camera, a video, pictures or a recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tubefoot.cli.progress import with_progress
from tubefoot.errors import ConfigError, TubefootError

if TYPE_CHECKING:
    import numpy as np

    from tubefoot.vision.calibration import CameraCalibration
    from tubefoot.vision.camera import Camera
    from tubefoot.vision.finger import FingerTracker
    from tubefoot.vision.layout import MarkerLayout


def track(
    source: str,
    *,
    camera: Path | None = None,
    layout: Path | None = None,
    out: Path = Path("out/track"),
    video: bool = True,
    live: int | None = None,
    frames: int = 0,
    frames_per_s: float = 30.0,
) -> None:
    """Track the finger: bending angle, theta1, theta2 and their uncertainty in each frame.

    Writes angles.csv and annotated.mp4. A frame that does not determine an angle says `lost` and why.
    Interrupting (Ctrl-C) keeps what was measured.

    Example: `tubefoot track virtual --frames 60 --out out/track`

    Parameters
    ----------
    source
        Webcam (0, /dev/video0), video file, folder of pictures, recording (.mcap), or `virtual`.
    camera
        camera.toml from `tubefoot calibrate-camera`; a virtual source knows its own.
    layout
        Marker layout of the finger (TOML); the 12-unit reference finger's if not given.
    out
        Directory for the result.
    video
        Whether to write annotated.mp4.
    live
        Port of a live view in the browser; 0 takes a free one.
    frames
        Stop after this many frames; 0 goes on to the end.
    frames_per_s
        Rate of a webcam, of a folder's pictures and of the annotated video [1/s].
    """
    from tubefoot.records import Run
    from tubefoot.vision.calibration import load_calibration
    from tubefoot.vision.finger import FingerTracker
    from tubefoot.vision.layout import chosen_layout

    if frames < 0 or frames_per_s <= 0:
        raise ConfigError("--frames must be 0 or more and --frames-per-s above 0")
    markers = chosen_layout(layout)
    if source == "virtual":
        device, calibration = _virtual(markers, frames_per_s, frames or 150)
    elif camera is None:
        raise ConfigError("--camera is missing: name the camera.toml that `tubefoot calibrate-camera` wrote")
    else:
        calibration = load_calibration(camera)
        device = _source(source, calibration, frames_per_s)
    settings = {"source": source, "camera": calibration.model_dump(), "layout": markers.model_dump()}
    run = Run(out, "track", settings)
    _track(run, device, FingerTracker(calibration, markers), video, live, frames, frames_per_s)


def _track(
    run: Any,
    device: Camera,
    tracker: FingerTracker,
    video: bool,
    live: int | None,
    most_frames: int,
    frames_per_s: float,
) -> None:
    from contextlib import ExitStack

    from tubefoot.records import write_table
    from tubefoot.vision.annotate import VideoWriter, annotated
    from tubefoot.vision.live import LiveView
    from tubefoot.vision.session import ANGLE_COLUMNS, angle_row, measured_frames

    rows: list[dict[str, Any]] = []
    columns = [*ANGLE_COLUMNS, *(f"level_{column.name}_mm" for column in tracker.layout.columns)]
    ended: BaseException | None = None
    with ExitStack() as stack:
        stack.enter_context(device)
        film = VideoWriter(run.path("annotated.mp4"), frames_per_s) if video else None
        view = LiveView(live) if live is not None else None
        for opened in (film, view):
            if opened is not None:
                stack.callback(opened.close)
        if view is not None:
            print(f"live view: {view.address}", flush=True)
        try:
            measured = measured_frames(device, tracker)
            for frame, reading in with_progress(measured, "frames", most_frames or None):
                rows.append(angle_row(frame, reading, tracker))
                if film is not None or view is not None:
                    side = tracker.layout.marker_side_mm
                    picture = annotated(frame.picture, reading, tracker.plane_map, side)
                    for shown in (film.add if film else None, view.show if view else None):
                        if shown is not None:
                            shown(picture)
                if len(rows) == most_frames:
                    break
        except (TubefootError, KeyboardInterrupt) as error:
            ended = error
    path = write_table(run.path("angles.csv"), rows, columns)
    reason = "end of source" if ended is None else (str(ended) or "interrupted")
    run.finish(frames=len(rows), end_reason=reason)
    lost = sum(row["lost"] for row in rows)
    print(f"{len(rows)} frames, tip lost in {lost}")
    print(f"angles: {path}")
    if ended is not None:
        raise ended


def _source(source: str, calibration: CameraCalibration, frames_per_s: float) -> Camera:
    from tubefoot.vision.sources import EncodedFrames, open_source

    if source.endswith(".mcap"):
        from tubefoot.lab.recording import Recording

        recording = Recording(Path(source))
        return EncodedFrames(lambda: ((frame.time, frame.encoded) for frame in recording.frames()), source)
    size = (calibration.lens.width_px, calibration.lens.height_px)
    return open_source(source, size, frames_per_s)


def _virtual(markers: MarkerLayout, frames_per_s: float, frames: int) -> tuple[Camera, CameraCalibration]:
    """A virtual camera before a finger that bends to and fro, its clock moved by one frame a picture."""
    from itertools import count

    import numpy as np

    from tubefoot.units import DEG
    from tubefoot.vision.calibration import CameraCalibration
    from tubefoot.vision.rehearsal import Rehearsal, even_bend
    from tubefoot.vision.sources import VirtualCamera

    rehearsal = Rehearsal(markers)
    ticks = count()
    now = [0.0]

    def draw(time_s: float) -> np.ndarray:
        now[0] = (next(ticks) + 1) / frames_per_s
        return rehearsal.frame(even_bend(markers, 60 * DEG * np.sin(2 * np.pi * time_s / 3)))

    size = (rehearsal.lens.width, rehearsal.lens.height)
    last = (frames - 0.5) / frames_per_s
    device = VirtualCamera(draw, size, lambda: now[0], oldest_s=2 / frames_per_s, last_s=last)
    calibration = CameraCalibration.of(rehearsal.lens, rehearsal.plane).model_copy(update={"zeroed": True})
    return device, calibration
