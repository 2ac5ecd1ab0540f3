"""Verdict: whether an alignment may be reported as a measurement.

An angle is good only if everything speaks for it: the picture correlates with the model, the size is right,
most of the marker is seen, the cells read as this marker and nearer to it than to any other, and the
uncertainty is small.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tubefoot.config import Settings
from tubefoot.units import DEG
from tubefoot.vision.alignment import Fit, MarkerTarget
from tubefoot.vision.marker import all_codes, marker_cells


class Acceptance(Settings):
    """Limits that a marker must meet to count as seen."""

    correlation: float = Field(default=0.97, ge=0.5, le=1)
    """least correlation of picture and model over the visible part"""
    visible: float = Field(default=0.75, ge=0.3, le=1)
    """least visible share of the marker"""
    size: float = Field(default=0.06, gt=0, le=0.5)
    """largest relative deviation from the nominal size in the plane"""
    cell_error: float = Field(default=0.35, gt=0, le=1)
    """a cell that is further off than this share of the contrast counts as covered"""
    sigma_deg: float = Field(default=0.15, gt=0, le=10)
    """largest standard uncertainty of the angle"""
    residual: float = Field(default=0.12, gt=0, le=1)
    """largest misfit of the visible part, as a share of the contrast"""


def fault_of(fit: Fit | None, target: MarkerTarget, limits: Acceptance) -> str:
    """Why a fit is no measurement, in a few words; empty when it is one.

    fit : the alignment, None when there was none
    target : the marker that was looked for
    limits : what is asked of it
    """
    if fit is None:
        return "no contrast"
    if not fit.converged:
        return "did not settle"
    if fit.correlation < limits.correlation or fit.residual > limits.residual:
        return "does not match"
    if abs(fit.log_scale) > limits.size:
        return "wrong size"
    if fit.inliers < limits.visible:
        return "covered"
    variance = fit.covariance[2, 2]
    if not variance > 0 or np.sqrt(variance) > limits.sigma_deg * DEG:
        return "too uncertain"
    return _code_fault(fit, target, limits)


def _code_fault(fit: Fit, target: MarkerTarget, limits: Acceptance) -> str:
    """Faults that only the single cells show."""
    cells = marker_cells(target.dictionary, target.marker_id)
    errors = np.nan_to_num(fit.cell_errors, nan=1.0)
    off = np.abs(errors) > limits.cell_error
    if np.mean(off) > 1 - limits.visible:
        return "covered"
    if not _reaches_edge(off):
        return "cells of another marker"
    read = (cells + errors > 0.5)[1:-1, 1:-1]
    codes = all_codes(target.dictionary)
    distances = np.sum(codes != read, axis=(2, 3))
    own = int(distances[target.marker_id, 0])
    distances[target.marker_id, 0] = read.size
    return "" if own < int(np.min(distances)) else "reads as another marker"


def _reaches_edge(off: NDArray[np.bool_]) -> bool:
    """Whether every patch of wrong cells comes in from outside, as what covers a marker does."""
    count, patches = cv2.connectedComponents(off.astype(np.uint8), connectivity=8)
    ring = np.concatenate([patches[0], patches[-1], patches[:, 0], patches[:, -1]])
    return set(range(1, count)) <= set(ring.tolist())
