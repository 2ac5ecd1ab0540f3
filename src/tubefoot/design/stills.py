"""Pictures of parts without a display: PyVista in a process of its own, which VTK may end without OpenGL."""

from __future__ import annotations

import ctypes.util
import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tubefoot.design.surface import TriangleMesh

WINDOW_PX = (1500, 1200)
MARGIN_PX = 24
WIDTH_PX = 1000
TIME_LIMIT_S = 300.0
OPENGL_LIBRARIES = ("EGL", "OSMesa")


@dataclass(frozen=True)
class Item:
    """A mesh in a picture."""

    mesh: TriangleMesh
    colour: tuple[float, float, float]
    opacity: float = 1.0


@dataclass(frozen=True)
class Picture:
    """Items seen from a direction; `up` points upwards in the picture."""

    name: str
    items: list[Item]
    view: tuple[float, float, float] = (0.6, -1.0, 0.5)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)


def can_draw() -> bool:
    """Whether an OpenGL that needs no display is installed, and PyVista."""
    from importlib.util import find_spec

    return find_spec("pyvista") is not None and any(map(ctypes.util.find_library, OPENGL_LIBRARIES))


def draw(pictures: list[Picture], directory: Path) -> dict[str, Path]:
    """The PNG files by the pictures' names; none where OpenGL or PyVista is missing or fails.

    pictures : what to draw
    directory : where to write `NAME.png`
    """
    if not can_draw():
        return {}
    directory.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as store:
        job = {"window": WINDOW_PX, "pictures": [_stored(picture, Path(store)) for picture in pictures]}
        plan = Path(store) / "job.json"
        plan.write_text(json.dumps(job))
        command = [sys.executable, "-m", "tubefoot.design.stills", str(plan), str(directory)]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=TIME_LIMIT_S)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return {}
    return {picture.name: directory / f"{picture.name}.png" for picture in pictures}


def _stored(picture: Picture, store: Path) -> dict[str, object]:
    files = []
    for number, item in enumerate(picture.items):
        path = store / f"{picture.name}-{number}.npz"
        np.savez(path, points=item.mesh.points, triangles=item.mesh.triangles)
        files.append({"mesh": str(path), "colour": item.colour, "opacity": item.opacity})
    return {**{k: v for k, v in asdict(picture).items() if k != "items"}, "items": files}


def _render(plan: Path, directory: Path) -> None:
    """Draw a stored job; runs in the child process."""
    import pyvista

    pyvista.OFF_SCREEN = True
    job = json.loads(plan.read_text())
    for picture in job["pictures"]:
        plotter = pyvista.Plotter(off_screen=True, window_size=job["window"], lighting="light kit")
        plotter.set_background("white")
        for item in picture["items"]:
            with np.load(item["mesh"]) as stored:
                points, triangles = stored["points"], stored["triangles"]
            faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
            surface = pyvista.PolyData(points, faces)
            look = {
                "color": item["colour"],
                "opacity": item["opacity"],
                "specular": 0.2,
                "smooth_shading": False,
            }
            plotter.add_mesh(surface, **look)
            edges = surface.extract_feature_edges(
                feature_angle=25, boundary_edges=False, manifold_edges=False, non_manifold_edges=False
            )
            if edges.n_points:
                plotter.add_mesh(edges, color=(0.45, 0.47, 0.5), line_width=1.2, opacity=item["opacity"])
        plotter.view_vector(picture["view"], viewup=picture["up"])
        plotter.enable_anti_aliasing("ssaa")
        image = plotter.screenshot(return_img=True)
        plotter.close()
        _save_cropped(image, directory / f"{picture['name']}.png")


def _save_cropped(image: NDArray[np.uint8], path: Path) -> None:
    """Write what is not white, with a margin, at most `WIDTH_PX` wide."""
    from PIL import Image

    inked = image.min(axis=2) < 250
    rows, columns = np.flatnonzero(inked.max(axis=1)), np.flatnonzero(inked.max(axis=0))
    top, bottom = max(0, rows[0] - MARGIN_PX), rows[-1] + MARGIN_PX
    left, right = max(0, columns[0] - MARGIN_PX), columns[-1] + MARGIN_PX
    picture = Image.fromarray(image[top:bottom, left:right])
    picture.thumbnail((WIDTH_PX, WIDTH_PX))
    picture.save(path, optimize=True)


if __name__ == "__main__":
    _render(Path(sys.argv[1]), Path(sys.argv[2]))
