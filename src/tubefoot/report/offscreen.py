"""Solids drawn without a display: PyVista in a process of its own, since VTK may crash without OpenGL.

All images of a call share one scale in pixels per millimetre (parallel projection), so that fingers of
different length compare by eye.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.report.scale import ColourScale
from tubefoot.report.surface import Surface

FloatArray = NDArray[np.float64]

LONGEST_SIDE_PX = 1500
FINEST_PX_PER_MM = 26.0
MARGIN_MM = 0.8
TIME_LIMIT_S = 600.0
EDGE_ANGLE_DEG = 32.0
LIFT_MM = 0.06
"""Edges are drawn this much before the faces they bound, so that they are not half hidden in them."""
AMBIENT = 0.45
WINDOWS = ("", "vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
"""Tried in turn: VTK's own choice, EGL, OSMesa."""
REMEDY = "install a software OpenGL (Debian: apt-get install libegl1 libgl1 libosmesa6)"


class NoPicture(Exception):
    """No solid can be drawn here; the message says why and what to do. Curves do not need it."""


@dataclass(frozen=True)
class View:
    """Where the camera looks from; `up` points upwards in the image."""

    direction: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def project(self, points: FloatArray) -> FloatArray:
        """Coordinates right and up in the image, (n, 2) [mm].

        points : (n, 3) [mm]
        """
        towards = np.array(self.direction) / np.linalg.norm(self.direction)
        right = np.cross(self.up, towards)
        right /= np.linalg.norm(right)
        return points @ np.stack([right, np.cross(towards, right)], axis=1)


@dataclass(frozen=True)
class Shot:
    """A surface to draw, coloured by a field on a scale."""

    surface: Surface
    scale: ColourScale
    view: View


@dataclass(frozen=True)
class Image:
    """A drawn surface; `extent` left, right, bottom, top [mm] in the view's coordinates."""

    pixels: NDArray[np.uint8]
    extent: tuple[float, float, float, float]


def draw_solids(shots: Sequence[Shot]) -> list[Image]:
    """An image of each surface, all at one scale.

    shots : what to draw

    Raises NoPicture where no OpenGL works without a display.
    """
    extents = [_extent(shot) for shot in shots]
    longest = max(max(e[1] - e[0], e[3] - e[2]) for e in extents)
    density = min(FINEST_PX_PER_MM, LONGEST_SIDE_PX / longest)
    with tempfile.TemporaryDirectory() as name:
        store = Path(name)
        plan = [
            _stored(store / f"shot-{number}.npz", shot, extent, density)
            for number, (shot, extent) in enumerate(zip(shots, extents, strict=True))
        ]
        (store / "plan.json").write_text(json.dumps(plan))
        _run_child(store / "plan.json")
        return [Image(np.load(job["image"]), extent) for job, extent in zip(plan, extents, strict=True)]


def _extent(shot: Shot) -> tuple[float, float, float, float]:
    flat = shot.view.project(shot.surface.deformed[np.unique(shot.surface.triangles)])
    (left, bottom), (right, top) = flat.min(axis=0) - MARGIN_MM, flat.max(axis=0) + MARGIN_MM
    return float(left), float(right), float(bottom), float(top)


def _stored(path: Path, shot: Shot, extent: tuple[float, ...], density: float) -> dict[str, Any]:
    surface, scale, view = shot.surface, shot.scale, shot.view
    np.savez(path, points=surface.deformed, triangles=surface.triangles, values=surface.value(scale.field))
    return {
        "mesh": str(path),
        "image": str(path.with_suffix(".npy")),
        "window": [round((extent[1] - extent[0]) * density), round((extent[3] - extent[2]) * density)],
        "centre": [(extent[0] + extent[1]) / 2, (extent[2] + extent[3]) / 2],
        "half_height": (extent[3] - extent[2]) / 2,
        "direction": view.direction,
        "up": view.up,
        "map": scale.map_name,
        "limits": [scale.low, scale.high],
    }


def _run_child(plan: Path) -> None:
    """Draw in a child, with each kind of OpenGL window until one works."""
    said = ""
    for window in WINDOWS:
        environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
        if window:
            environment["VTK_DEFAULT_OPENGL_WINDOW"] = window
        command = [sys.executable, "-m", "tubefoot.report.offscreen", str(plan)]
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False
            )
        except subprocess.TimeoutExpired:
            raise NoPicture(f"drawing took over {TIME_LIMIT_S:.0f} s and was stopped") from None
        if done.returncode == 0:
            return
        said = said or done.stderr.strip()[-300:]
        if "ModuleNotFoundError" in done.stderr:
            raise NoPicture("PyVista is not installed: pip install 'tubefoot[fea]'")
    raise NoPicture(f"no OpenGL works without a display; {REMEDY}" + (f". VTK said: {said}" if said else ""))


def _render(plan: Path) -> None:
    """Draw a stored plan; runs in the child."""
    import pyvista

    pyvista.OFF_SCREEN = True
    for job in json.loads(plan.read_text()):
        with np.load(job["mesh"]) as stored:
            points, triangles, values = stored["points"], stored["triangles"], stored["values"]
        faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
        surface = pyvista.PolyData(points, faces)
        surface.point_data["shown"] = values
        plotter = pyvista.Plotter(off_screen=True, window_size=job["window"], lighting="none")
        plotter.set_background("white")
        plotter.add_light(pyvista.Light(light_type="headlight"))
        plotter.add_mesh(
            surface,
            scalars="shown",
            cmap=job["map"],
            clim=job["limits"],
            show_scalar_bar=False,
            # A face that looks at the camera shows the colour of the scale exactly.
            ambient=AMBIENT,
            diffuse=1.0 - AMBIENT,
            specular=0.0,
        )
        edges = surface.clean().extract_feature_edges(
            feature_angle=EDGE_ANGLE_DEG, boundary_edges=True, manifold_edges=False, non_manifold_edges=False
        )
        if edges.n_points:
            towards = np.array(job["direction"]) / np.linalg.norm(job["direction"])
            edges.points = edges.points + LIFT_MM * towards
            plotter.add_mesh(edges, color=(0.1, 0.1, 0.12), line_width=1.3, lighting=False)
        _aim(plotter, job, points)
        plotter.enable_anti_aliasing("ssaa")
        image = plotter.screenshot(return_img=True)
        plotter.close()
        np.save(job["image"], image)


def _aim(plotter: Any, job: dict[str, Any], points: FloatArray) -> None:
    """Set the camera so that the image has the planned extent and scale."""
    towards = np.array(job["direction"]) / np.linalg.norm(job["direction"])
    right = np.cross(job["up"], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    depth = points @ towards
    centre = job["centre"][0] * right + job["centre"][1] * up + depth.mean() * towards
    distance = 4.0 * float(np.ptp(depth)) + 50.0
    camera = plotter.camera
    camera.focal_point, camera.position, camera.up = centre, centre + distance * towards, up
    camera.parallel_projection = True
    camera.parallel_scale = job["half_height"]
    camera.clipping_range = (0.2 * distance, 2.0 * distance)


if __name__ == "__main__":
    _render(Path(sys.argv[1]))
