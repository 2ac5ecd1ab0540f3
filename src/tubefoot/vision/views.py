"""Views: intrinsics from pictures of the board, the bending plane from one of them, and how good they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.units import DEG
from tubefoot.vision.board import Board
from tubefoot.vision.lens import FloatArray, Lens
from tubefoot.vision.plane import PlanePose

LEAST_CORNERS = 8
LEAST_VIEWS = 6
COVERAGE_GRID = (8, 6)

GOOD_RESIDUAL_PX = 0.35
GOOD_COVERAGE = 0.6
GOOD_TILT_DEG = 15.0
GOOD_FOCAL_SIGMA = 0.005


@dataclass(frozen=True)
class BoardView:
    """Corners of the board found in one picture.

    name : of the picture
    ids : (n,) corner numbers
    pixels : (n, 2) where they appear [px]
    """

    name: str
    ids: NDArray[np.intp]
    pixels: FloatArray


@dataclass(frozen=True)
class LensCalibration:
    """A lens and the evidence for it.

    lens : the result
    views : those that were used
    residuals : for each view (n, 2), seen minus predicted [px]
    residual_px : root mean square of all residual vectors' components [px]
    coverage : share of the picture's grid cells with a corner in some view
    tilt_span_deg : largest tilt of a view against facing the camera [deg]
    focal_sigma : relative standard uncertainty of the focal length
    dropped : names of pictures without enough corners
    """

    lens: Lens
    views: list[BoardView]
    residuals: list[FloatArray]
    residual_px: float
    coverage: float
    tilt_span_deg: float
    focal_sigma: float
    dropped: list[str]

    def faults(self) -> list[str]:
        """What is wrong with this calibration, each with number, limit and remedy; empty when good."""
        found = []
        if self.residual_px > GOOD_RESIDUAL_PX:
            found.append(
                f"residual {self.residual_px:.2f} px exceeds {GOOD_RESIDUAL_PX} px: "
                "hold the board flat and still, and focus"
            )
        if self.coverage < GOOD_COVERAGE:
            found.append(
                f"the corners cover {self.coverage:.0%} of the picture, less than {GOOD_COVERAGE:.0%}: "
                "add views with the board near the picture's edges"
            )
        if self.tilt_span_deg < GOOD_TILT_DEG:
            found.append(
                f"the board was tilted by {self.tilt_span_deg:.0f} deg at most, less than "
                f"{GOOD_TILT_DEG:.0f} deg: add views with the board tilted either way"
            )
        if self.focal_sigma > GOOD_FOCAL_SIGMA:
            found.append(
                f"the focal length is uncertain by {self.focal_sigma:.2%}, more than {GOOD_FOCAL_SIGMA:.1%}: "
                "add more tilted views"
            )
        return found


def gather_views(
    frames: Iterable[tuple[str, NDArray[np.uint8]]], board: Board
) -> tuple[list[BoardView], list[str], tuple[int, int]]:
    """Board views, names of the pictures without one, and the picture size (width, height).

    frames : name and picture of each
    board : the board that was shown

    Raises ConfigError when there is no picture, or pictures differ in size.
    """
    views, dropped = [], []
    size: tuple[int, int] | None = None
    for name, frame in frames:
        height, width = frame.shape[:2]
        if size not in (None, (width, height)):
            raise ConfigError(
                f"{name} is {width} x {height} px, the pictures before it {size[0]} x {size[1]} px; "
                "calibrate one resolution at a time"
            )
        size = (width, height)
        ids, pixels = board.find(frame)
        if len(ids) >= LEAST_CORNERS:
            views.append(BoardView(name, ids, pixels))
        else:
            dropped.append(name)
    if size is None:
        raise ConfigError("there are no pictures to calibrate from")
    return views, dropped, size


def calibrate_lens(
    views: list[BoardView], board: Board, size: tuple[int, int], dropped: list[str]
) -> LensCalibration:
    """The lens that explains the views best.

    views : at least six pictures of the board
    board : the board that was shown
    size : picture width and height [px]
    dropped : names of pictures that showed too little, for the record

    Raises ConfigError when there are too few views.
    """
    if len(views) < LEAST_VIEWS:
        raise ConfigError(
            f"only {len(views)} of {len(views) + len(dropped)} pictures show at least {LEAST_CORNERS} "
            f"corners of a {board.settings.squares_x} x {board.settings.squares_y} board, "
            f"{LEAST_VIEWS} are needed. "
            "Check squares_x and squares_y, and that the board is sharp and in full light"
        )
    objects = [_flat(board.corners[view.ids]) for view in views]
    pixels = [view.pixels.astype(np.float32).reshape(-1, 1, 2) for view in views]
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    unknown: Any = None
    _, matrix, distortion, turns, shifts, deviations, _, _ = cv2.calibrateCameraExtended(
        objects, pixels, size, unknown, unknown, flags=0, criteria=criteria
    )
    lens = Lens(
        *size,
        float(matrix[0, 0]),
        float(matrix[1, 1]),
        float(matrix[0, 2]),
        float(matrix[1, 2]),
        tuple(float(value) for value in np.ravel(distortion)[:5]),
    )
    residuals = []
    for view, points, turn, shift in zip(views, objects, turns, shifts, strict=True):
        rotation, _ = cv2.Rodrigues(turn)
        residuals.append(view.pixels - lens.project(points.reshape(-1, 3) @ rotation.T + shift.ravel()))
    tilts = [np.arccos(min(abs(float(cv2.Rodrigues(turn)[0][2, 2])), 1.0)) / DEG for turn in turns]
    everything = np.vstack(residuals)
    return LensCalibration(
        lens=lens,
        views=views,
        residuals=residuals,
        residual_px=float(np.sqrt(np.mean(everything**2))),
        coverage=_coverage(views, size),
        tilt_span_deg=float(max(tilts)),
        focal_sigma=float(max(np.ravel(deviations)[:2]) / lens.focal_x),
        dropped=dropped,
    )


def plane_of_view(view: BoardView, board: Board, lens: Lens) -> tuple[PlanePose, float]:
    """The plane that the board lies in, in the board's frame, and the standard uncertainty of its tilt [rad].

    view : a picture of the board held in the bending plane
    board : the board
    lens : the calibrated lens
    """
    points = _flat(board.corners[view.ids]).astype(float)
    pixels = np.ascontiguousarray(view.pixels, dtype=float).reshape(-1, 1, 2)
    distortion = np.array(lens.distortion)
    found, turn, shift = cv2.solvePnP(points, pixels, lens.matrix, distortion, flags=cv2.SOLVEPNP_IPPE)
    if not found:
        raise ConfigError(f"{view.name}: the board's pose cannot be found; take the plane view again")
    turn, shift = cv2.solvePnPRefineLM(points, pixels, lens.matrix, distortion, turn, shift)
    predicted, slopes = cv2.projectPoints(points, turn, shift, lens.matrix, distortion)
    misfit = (predicted - pixels).ravel()
    covariance = np.linalg.inv(slopes[:, :6].T @ slopes[:, :6]) * (misfit @ misfit) / max(misfit.size - 6, 1)
    rotation, _ = cv2.Rodrigues(turn)
    axes = np.column_stack([rotation[:, 0], rotation[:, 2], -rotation[:, 1]])
    sigma = float(np.sqrt(np.max(np.linalg.eigvalsh(covariance[:3, :3]))))
    return PlanePose(np.asarray(axes, dtype=float), np.asarray(shift, dtype=float).ravel()), sigma


def _flat(corners: FloatArray) -> NDArray[np.float32]:
    """Corners (n, 1, 3) in OpenCV's board frame: x right, y down, z away from the camera."""
    return np.column_stack([corners[:, 0], -corners[:, 1], np.zeros(len(corners))]).astype(np.float32)[
        :, None
    ]


def _coverage(views: list[BoardView], size: tuple[int, int]) -> float:
    everything = np.vstack([view.pixels for view in views])
    counts, _, _ = np.histogram2d(
        everything[:, 0], everything[:, 1], bins=COVERAGE_GRID, range=[[0, size[0]], [0, size[1]]]
    )
    return float(np.mean(counts > 0))
