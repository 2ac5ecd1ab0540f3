"""Pictures to calibrate from, chosen out of a folder, a video, a live camera, or one file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.board import Board
from tubefoot.vision.camera import Camera, EndOfFrames, Frame
from tubefoot.vision.picture_files import ImageFolder, VideoFile, read_image
from tubefoot.vision.sources import open_source
from tubefoot.vision.tracker import MarkerReading, MarkerTracker

VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov")
FEWEST_CORNERS = 8
MOVED_SHARE = 0.05
"""A board in a video counts as a new view when it has moved by this share of the picture's width."""

NEUTRAL_FRAMES = 30


def frames_of(camera: Camera, most: int) -> Iterator[Frame]:
    """The frames of an open camera until it ends.

    camera : any source
    most : frames at the most
    """
    for _ in range(most):
        try:
            yield camera.read()
        except EndOfFrames:
            return


def board_views(frames: Iterable[Frame], board: Board, most: int) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Name and picture of each view: all that there are, or those in which the board has moved on.

    frames : in order of time
    board : what is looked for
    most : views from a film, each one with the board elsewhere than before; 0: every frame is a view
    """
    seen: list[NDArray[np.float64]] = []
    for frame in frames:
        if most:
            ids, pixels = board.find(frame.picture)
            if len(ids) < FEWEST_CORNERS:
                continue
            place = np.concatenate([pixels.mean(axis=0), pixels.std(axis=0)])
            if any(np.linalg.norm(place - other) < MOVED_SHARE * frame.picture.shape[1] for other in seen):
                continue
            seen.append(place)
        yield f"frame {frame.index}", frame.picture
        if most and len(seen) == most:
            return


def one_picture(source: str) -> NDArray[np.uint8]:
    """The picture of a file, or the first one of a folder, a video, a camera.

    source : path, or number of a camera
    """
    path = Path(source)
    if path.is_file() and path.suffix.lower() not in VIDEO_SUFFIXES:
        return read_image(path)
    with open_source(source, (640, 480)) as camera:
        return camera.read().picture


def readings_at_rest(source: Path, tracker: MarkerTracker) -> list[dict[int, MarkerReading]]:
    """What each picture of a finger at rest says about its markers, thirty pictures at the most.

    source : picture, folder or video
    tracker : measures the markers
    """
    if not source.is_dir() and source.suffix.lower() not in VIDEO_SUFFIXES:
        return [tracker.measure(read_image(source), 0.0)]
    with ImageFolder(source) if source.is_dir() else VideoFile(source) as camera:
        return [tracker.measure(frame.picture, frame.time_s) for frame in frames_of(camera, NEUTRAL_FRAMES)]
