"""Alignment: the pose of a marker in the bending plane, from all pixels that show it.

Model of a pixel at plane point P (Gauss-Newton, all unknowns at once, on the raw pixels, nothing resampled):

    I = a0 + a1 x + a2 y + (b0 + b1 x + b2 y) T(q) + c_uu T_uu + c_uv T_uv + c_vv T_vv + d T (1 - T),
    q = R(-angle) (P - centre) / (side exp(s))

with the template T, a light gradient (a, b), residual blur in any direction (c), the tone curve (d). Pixels
that do not fit (an occluder, glare) lose their weight (Tukey's biweight). The covariance is the sandwich
estimate over neighbouring pixels, so that compression noise and model error, which are correlated, count as
what they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.lens import FloatArray
from tubefoot.vision.plane import PlanarPose, PlaneMap, wrap_angle
from tubefoot.vision.template import find_template, rounded_blur

Pixels = NDArray[np.float32]

POSE_TERMS = 4
"""The unknowns are x, z, angle, s; then a0, a1, a2, b0, b1, b2, c_uu, c_uv, c_vv, d."""

TERMS = 14
GAIN = POSE_TERMS + 3
DAMPING = 1e-7 * np.eye(TERMS)
LARGEST_LOG_SCALE = 0.3
MIN_CONTRAST = 12.0
"""Least difference of paper and ink [grey levels]."""

TUKEY = 4.685
EDGE_ALLOWANCE_PX = 0.12
"""Misfit of an edge that is not taken for an occluder."""

MOST_PIXELS = 4200
"""A larger marker is compared on every other pixel, as on the black fields of a chessboard."""

WINDOW_SLACK_PX = 1.5
"""A marker that turns out to lie further than this from its start has left the window [px]."""

WEIGHED_NEAR_PX = 0.25
"""Weights count only if the pose that they were taken at was this near its end [px]."""

REST_PX = 0.015
"""A step of all unknowns below this ends the descent; the next one would be some ten times smaller [px]."""

QUIET_SHARE = 0.9
"""Part of the white margin that is compared."""


@dataclass(frozen=True)
class MarkerTarget:
    """What is looked for.

    dictionary : name of the marker dictionary
    marker_id : which marker
    side : side of its black square [mm]
    quiet : white margin [mm]
    """

    dictionary: str
    marker_id: int
    side: float
    quiet: float


@dataclass(frozen=True)
class Fit:
    """Outcome of one alignment.

    pose : of the marker's centre in the plane
    log_scale : apparent size against the nominal one, as a logarithm
    blur_px : standard deviation of the blur [px]
    covariance : (3, 3) of x, z [mm] and angle [rad]
    correlation : of picture and model over the pixels that count, 0 to 1
    residual : root mean square misfit of these, as a share of the contrast
    inliers : share of the marker's area that fits the model
    cell_errors : (n, n) brightness minus model in each cell, shares of the contrast; NaN where too few pixels
    contrast : paper minus ink [grey levels]
    converged : whether the last step was small
    """

    pose: PlanarPose
    log_scale: float
    blur_px: float
    covariance: FloatArray
    correlation: float
    residual: float
    inliers: float
    cell_errors: FloatArray
    contrast: float
    converged: bool


def align_marker(
    frame: NDArray[np.uint8],
    plane_map: PlaneMap,
    target: MarkerTarget,
    start: PlanarPose,
    blur_px: float = 0.85,
    coarse: bool = False,
    row_drift: tuple[float, float] = (0.0, 0.0),
) -> Fit | None:
    """The best fit of a marker near a starting pose, None when there is nothing to fit there.

    frame : (height, width) grey picture
    plane_map : plane point of each pixel
    target : the marker that is looked for
    start : pose to start from, within about two pixels, or a tenth of the marker with `coarse`
    blur_px : expected blur [px]
    coarse : start with a strong blur, to catch a start that is further off
    row_drift : motion of the marker from one row to the next of a rolling shutter [mm]
    """
    problem = _Problem(frame, plane_map, target, start, row_drift)
    if problem.grey.size < 60:
        return None
    if coarse:
        for share in (0.09, 0.045):
            if not problem.descend(max(blur_px, share * problem.side_px), 4, keep_blur=True):
                return None
    if not problem.descend(blur_px, 12):
        return None
    moved = np.hypot(problem.pose.x - start.x, problem.pose.z - start.z) / target.side * problem.side_px
    if moved > WINDOW_SLACK_PX:
        problem = _Problem(frame, plane_map, target, problem.pose, row_drift)
        if problem.grey.size < 60 or not problem.descend(blur_px, 8):
            return None
    return problem.fit()


class _Problem:
    """Pixels around a marker and the present state of the fit to them."""

    def __init__(
        self,
        frame: NDArray[np.uint8],
        plane_map: PlaneMap,
        target: MarkerTarget,
        start: PlanarPose,
        row_drift: tuple[float, float],
    ):
        scale = plane_map.pixels_per_mm((start.x, start.z))
        self.target = target
        self.side_px = target.side * scale
        self.pose = start
        self.log_scale = 0.0
        self.converged = False
        self._gather(frame, plane_map, target.side / 2 + target.quiet + 2.0 / scale, row_drift)

    def _gather(
        self, frame: NDArray[np.uint8], plane_map: PlaneMap, reach: float, row_drift: tuple[float, float]
    ) -> None:
        corners = self.pose.to_outer(reach * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]))
        pixels = plane_map.to_pixels(corners)
        height, width = frame.shape
        x0, y0 = (int(value) for value in np.clip(np.floor(pixels.min(axis=0)), 0, (width, height)))
        x1, y1 = (int(value) for value in np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, (width, height)))
        self.shape = (max(y1 - y0, 0), max(x1 - x0, 0))
        points = plane_map.points[y0:y1, x0:x1].reshape(-1, 2)
        if row_drift != (0.0, 0.0):
            middle = plane_map.to_pixels([[self.pose.x, self.pose.z]])[0, 1]
            rows = np.repeat(np.arange(y0, y1, dtype=np.float32) - np.float32(middle), self.shape[1])
            points = points - rows[:, None] * np.array(row_drift, dtype=np.float32)
        own_x, own_z = self._own(points)
        near = np.flatnonzero((np.abs(own_x) < reach) & (np.abs(own_z) < reach))
        self.thinning = 1
        if near.size > MOST_PIXELS:
            rows, columns = np.divmod(near, self.shape[1])
            near = near[(rows + columns) % 2 == 0]
            self.thinning = 2
        self.index = near
        self.points = points[near]
        self.grey = frame[y0:y1, x0:x1].reshape(-1)[near].astype(np.float32)
        self.across = own_x[near] / np.float32(reach)
        self.up = own_z[near] / np.float32(reach)
        self.columns = np.empty((TERMS, near.size), dtype=np.float32)
        self.columns[4:7] = np.ones_like(self.up), self.across, self.up

    def _own(self, points: Pixels) -> tuple[Pixels, Pixels]:
        cos, sin = np.float32(np.cos(self.pose.angle)), np.float32(np.sin(self.pose.angle))
        right, up = points[:, 0] - np.float32(self.pose.x), points[:, 1] - np.float32(self.pose.z)
        return cos * right + sin * up, cos * up - sin * right

    def descend(self, blur_px: float, most_steps: int, keep_blur: bool = False) -> bool:
        """Gauss-Newton steps to rest; False when the picture holds nothing to fit."""
        self.blur_px = blur_px
        self.weights = np.ones(self.grey.size, dtype=np.float32)
        self.gain = 100.0
        self.step_px = np.inf
        for step in range(most_steps):
            self._linearise()
            if not self._solve():
                return False
            before = self.step_px
            self._advance()
            self.converged = before < WEIGHED_NEAR_PX and self.step_px < REST_PX
            if self.converged:
                break
            self._weigh()
            if not keep_blur and step < 6:
                self._correct_blur()
        return True

    def _linearise(self) -> None:
        """Model columns (14, n) at the present state."""
        self.blur_level = rounded_blur(max(self.blur_px, 0.45) / self.side_px)
        template = find_template(self.target.dictionary, self.target.marker_id, self.blur_level)
        self.cells = template.cells
        size = np.float32(self.target.side * np.exp(self.log_scale))
        own_x, own_z = self._own(self.points)
        self.u, self.v = own_x / size, -own_z / size
        value, slope_u, slope_v, curve_uu, curve_uv, curve_vv = template.at(self.u, self.v)
        limit = np.float32(0.5 + QUIET_SHARE * self.target.quiet / self.target.side - 1.5 / self.side_px)
        self.inside = (np.abs(self.u) < limit) & (np.abs(self.v) < limit)
        gain = np.float32(self.gain)
        cos, sin = np.float32(np.cos(self.pose.angle)), np.float32(np.sin(self.pose.angle))
        self.value = value
        self.slope = np.sqrt(slope_u**2 + slope_v**2)
        slope_x, slope_z = slope_u * (gain / size), -slope_v * (gain / size)
        columns = self.columns
        columns[0] = slope_z * sin - slope_x * cos
        columns[1] = -slope_x * sin - slope_z * cos
        columns[2] = slope_x * own_z - slope_z * own_x
        columns[3] = -slope_x * own_x - slope_z * own_z
        columns[7] = value
        columns[8] = value * self.across
        columns[9] = value * self.up
        columns[10], columns[11], columns[12] = curve_uu, curve_uv, curve_vv
        columns[13] = value * (1 - value)

    def _solve(self) -> bool:
        """Weighted least squares for all unknowns."""
        self.counted = np.where(self.inside, self.weights, np.float32(0))
        if np.count_nonzero(self.counted) < 40:
            return False
        weighted = self.columns * self.counted
        normal = (weighted @ self.columns.T).astype(float)
        right = (weighted @ self.grey).astype(float)
        scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
        scaling = scale[:, None] * scale
        try:
            self.inverse = np.linalg.inv(normal * scaling + DAMPING) * scaling
        except np.linalg.LinAlgError:
            return False
        self.solution = self.inverse @ right
        self.gain = float(self.solution[GAIN])
        if not np.all(np.isfinite(self.solution)) or self.gain < MIN_CONTRAST:
            return False
        light = self.solution.astype(np.float32)
        self.model = light[POSE_TERMS:] @ self.columns[POSE_TERMS:]
        self.misfit = self.grey - self.model - light[:POSE_TERMS] @ self.columns[:POSE_TERMS]
        return True

    def _advance(self) -> None:
        """Move the pose by the solution, at most a fifth of the marker."""
        right, up, turn, growth = (float(value) for value in self.solution[:POSE_TERMS])
        arm = self.target.side / 2
        length = max(abs(right), abs(up), arm * abs(turn), arm * abs(growth))
        share = min(1.0, 0.2 * self.target.side / max(length, 1e-12))
        self.step_px = length / self.target.side * self.side_px
        self.pose = PlanarPose(
            self.pose.x + share * right, self.pose.z + share * up, self.pose.angle + share * turn
        )
        self.log_scale = min(max(self.log_scale + share * growth, -LARGEST_LOG_SCALE), LARGEST_LOG_SCALE)

    def _weigh(self) -> None:
        """Tukey weights from the misfit, with an allowance at edges."""
        misfit = np.abs(self.misfit[self.inside][:: 1 + self.grey.size // 1200])
        deviation = 1.4826 * float(np.partition(misfit, misfit.size // 2)[misfit.size // 2]) + 0.5
        edge = EDGE_ALLOWANCE_PX / self.side_px * self.gain * self.slope
        share = (self.misfit / (TUKEY * np.sqrt(deviation**2 + edge**2))) ** 2
        self.weights = np.where(share < 1, (1 - share) ** 2, 0).astype(np.float32)

    def _correct_blur(self) -> None:
        """Take the isotropic part of the residual blur into the template."""
        growth = (self.solution[10] + self.solution[12]) / self.gain
        variance = (self.blur_level**2 + growth) * self.side_px**2
        self.blur_px = min(max(float(variance), 0.45**2), (0.2 * self.side_px) ** 2) ** 0.5

    def fit(self) -> Fit:
        """Statistics of the present state."""
        counted = self.counted.astype(float)
        total = counted.sum()
        model = self.model - (counted @ self.model) / total
        grey = self.grey - (counted @ self.grey) / total
        spread = np.sqrt((counted @ model**2) * (counted @ grey**2))
        return Fit(
            pose=PlanarPose(self.pose.x, self.pose.z, wrap_angle(self.pose.angle)),
            log_scale=self.log_scale,
            blur_px=self.blur_px,
            covariance=self._covariance(),
            correlation=float((counted * model) @ grey / max(spread, 1e-9)),
            residual=float(np.sqrt(counted @ self.misfit.astype(float) ** 2 / total) / self.gain),
            inliers=float(
                np.count_nonzero(self.counted > 0.2) * self.thinning / max(self._expected_area(), 1.0)
            ),
            cell_errors=self._cell_errors(),
            contrast=self.gain,
            converged=self.converged,
        )

    def _expected_area(self) -> float:
        """Pixels that the compared square should cover, also where it leaves the picture."""
        limit = 0.5 + QUIET_SHARE * self.target.quiet / self.target.side - 1.5 / self.side_px
        return (2 * limit * self.side_px) ** 2

    def _covariance(self) -> FloatArray:
        """Sandwich covariance (3, 3): how the fit would scatter, neighbouring misfits being related."""
        influence = self.inverse[:3].astype(np.float32) @ (self.columns * (self.counted * self.misfit))
        plain = np.zeros((3, *self.shape), dtype=np.float32)
        plain.reshape(3, -1)[:, self.index] = influence
        near = np.stack([cv2.boxFilter(part, -1, (3, 3), normalize=False) for part in plain])
        alone = influence.astype(float)
        related = alone @ near.reshape(3, -1)[:, self.index].T.astype(float)
        matrix = (related + related.T) / 2
        np.fill_diagonal(matrix, np.maximum(np.diag(matrix), np.sum(alone**2, axis=1)))
        return matrix

    def _cell_errors(self) -> FloatArray:
        count = self.cells.shape[0]
        column = np.floor((self.u + 0.5) * count).astype(int)
        row = np.floor((self.v + 0.5) * count).astype(int)
        valid = (column >= 0) & (column < count) & (row >= 0) & (row < count)
        cell = row[valid] * count + column[valid]
        hits = np.bincount(cell, minlength=count**2)
        sums = np.bincount(cell, self.misfit[valid], minlength=count**2)
        errors = np.where(hits >= 2, sums / np.maximum(hits, 1) / self.gain, np.nan)
        return errors.reshape(count, count)
