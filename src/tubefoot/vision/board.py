"""The ChArUco board: a chessboard with a marker in each white square, for calibrating the camera.

Board coordinates are plane coordinates with the origin in the board's middle, x right and z up as printed.
The markers come from another dictionary than the finger's, so the two can be in one picture.
"""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.vision.camera import grey_picture
from tubefoot.vision.compositor import Decal, Motion, still
from tubefoot.vision.lens import FloatArray
from tubefoot.vision.marker import find_dictionary
from tubefoot.vision.plane import PlanarPose, PlanePose

CELLS_A_SQUARE = 28
MARKER_CELLS = 21
"""A marker of seven cells is three quarters of its square: both fall on this grid."""


class BoardSettings(Settings):
    """A ChArUco board."""

    squares_x: int = Field(default=7, ge=3, le=30)
    """squares across"""
    squares_y: int = Field(default=9, ge=3, le=30)
    """squares up"""
    square_mm: float = Field(default=20.0, ge=3, le=200)
    """side of a square as printed; measure it, printers scale"""

    @model_validator(mode="after")
    def _has_markers(self) -> BoardSettings:
        if self.squares_x * self.squares_y // 2 > 100:
            raise ValueError(
                f"{self.squares_x} x {self.squares_y} squares need more than the 100 markers there are; "
                "use fewer squares"
            )
        return self


class Board:
    """A board that can be drawn and found."""

    def __init__(self, settings: BoardSettings | None = None):
        """Make the board.

        settings : its size; the default fills an A4 sheet
        """
        self.settings = settings or BoardSettings()
        square = self.settings.square_mm
        size = (self.settings.squares_x, self.settings.squares_y)
        codes = find_dictionary("5x5_100")
        marker = square * MARKER_CELLS / CELLS_A_SQUARE
        self._board = cv2.aruco.CharucoBoard(size, square, marker, codes)
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._finder = cv2.aruco.CharucoDetector(self._board, cv2.aruco.CharucoParameters(), parameters)

    @property
    def width(self) -> float:
        """Width of the pattern [mm]."""
        return self.settings.squares_x * self.settings.square_mm

    @property
    def height(self) -> float:
        """Height of the pattern [mm]."""
        return self.settings.squares_y * self.settings.square_mm

    @cached_property
    def cells(self) -> NDArray[np.float32]:
        """The pattern as cells (rows, columns), top row first: 1 is white."""
        size = (self.settings.squares_x * CELLS_A_SQUARE, self.settings.squares_y * CELLS_A_SQUARE)
        return (self._board.generateImage(size, None, 0, 1) > 127).astype(np.float32)

    @property
    def corners(self) -> FloatArray:
        """Inner chessboard corners (n, 2) in board coordinates (x, z) [mm], in order of their ids."""
        flat = np.asarray(self._board.getChessboardCorners(), dtype=float)
        return np.column_stack([flat[:, 0] - self.width / 2, self.height / 2 - flat[:, 1]])

    def find(self, frame: NDArray[np.uint8]) -> tuple[NDArray[np.intp], FloatArray]:
        """Ids (n,) and pixels (n, 2) of the corners in a picture; empty when there is no board.

        frame : grey or colour picture
        """
        grey = grey_picture(frame)
        pixels, ids, _, _ = self._finder.detectBoard(grey)
        if ids is None or len(ids) == 0:
            return np.zeros(0, dtype=np.intp), np.zeros((0, 2))
        found = np.asarray(pixels, dtype=np.float32).reshape(-1, 1, 2)
        window = _refinement_window(found, ids, self.settings.squares_x - 1)
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 60, 1e-4)
        fine = cv2.cornerSubPix(grey, found, (window, window), (-1, -1), criteria)
        return np.ravel(ids).astype(np.intp), fine.reshape(-1, 2).astype(float)

    def decal(self, plane: PlanePose | None, motion: Motion | None = None) -> Decal:
        """The board as a thing that the compositor draws.

        plane : the plane it lies in, None for the scene's
        motion : pose of its middle in that plane
        """
        ink = (0.07 + 0.75 * self.cells).astype(np.float32)
        place = motion or still(PlanarPose())
        return Decal(ink, self.width, self.height, place, border=self.settings.square_mm / 2, plane=plane)


def _refinement_window(pixels: NDArray[np.float32], ids: NDArray, across: int) -> int:
    """Half window for sub-pixel corners [px]: inside the squares, so that no marker edge enters it."""
    place = {int(number): pixel for number, pixel in zip(np.ravel(ids), pixels.reshape(-1, 2), strict=True)}
    steps = [
        float(np.linalg.norm(place[number + 1] - pixel))
        for number, pixel in place.items()
        if number + 1 in place and (number + 1) % across
    ]
    return int(np.clip(0.11 * min(steps), 2, 8)) if steps else 3
