"""CalculiX (`ccx`): decks of the load case, runs, and the displacements that it found.

Its Ogden law is W = sum 2 mu_i / alpha_i^2 (sum_k lbar_k^alpha_i - 3) + sum (J - 1)^(2 i) / D_i (manual,
*HYPERELASTIC), which is ours with D_1 = 2 / kappa and no further D; a D of zero would be replaced by a
default. A distributed pressure follows the face in a geometrically nonlinear step. Convergence is judged by
its default residual of 0.5 % of the mean force alone: its second criterion, corrections below 1 % of the
increment, is never met in some reduced elements, whose softest mode keeps swinging by 0.004 mm.
"""

import re
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.finger_load import HANDS, FingerLoad, FloatArray, PeerRun, corner_faces, corner_sets
from benchmarks.measured import Usage, run_measured

KINDS = {"C3D20": "hexahedron20", "C3D20R": "hexahedron20", "C3D8I": "hexahedron8", "C3D10": "tetra10"}
"""Its elements, and the cells of ours that have their nodes, in the same order."""
HEXAHEDRON_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
TETRAHEDRON_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
NONE = 1e20
"""Value of a D_i that takes its term out."""


def available() -> bool:
    return shutil.which("ccx") is not None


def material_card(mu: Sequence[float], alpha: Sequence[float], bulk: float) -> list[str]:
    """The lines of a nearly incompressible Ogden material of one to three terms, named BODY.

    mu [MPa], alpha : terms; bulk : bulk modulus [MPa]
    """
    terms = [number for pair in zip(mu, alpha, strict=True) for number in pair]
    numbers = [*terms, 2.0 / bulk, *[NONE] * (len(mu) - 1)]
    lines = [numbers[first : first + 8] for first in range(0, len(numbers), 8)]
    return [
        "*MATERIAL, NAME=BODY",
        f"*HYPERELASTIC, OGDEN, N={len(mu)}",
        *(", ".join(f"{number:.12g}" for number in line) for line in lines),
    ]


def mesh_cards(points: FloatArray, cells: np.ndarray, element: str) -> list[str]:
    """The lines of the nodes and of the elements, set ALL."""
    rows = [*(f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(points, 1))]
    lines = ["*NODE, NSET=NALL", *rows, f"*ELEMENT, TYPE={element}, ELSET=ALL"]
    for number, nodes in enumerate(cells + 1, 1):
        entries = [str(number), *map(str, nodes)]
        lines += [", ".join(entries[:11]) + ("," if len(entries) > 11 else "")]
        lines += [", ".join(entries[11:])] if len(entries) > 11 else []
    return lines


def finger_deck(load: FingerLoad, element: str, first_increment: float) -> str:
    """The deck of the load case; displacements of the tip are printed at full load."""
    body, block = load.design.body, load.mesh.blocks[0]
    mu = [body.scale * value for value in body.mu_mpa]
    held = [f"{point + 1}, {axis + 1}" for point, axis in np.argwhere(load.held)]
    return "\n".join(
        [
            *mesh_cards(load.mesh.points, block.nodes, element),
            "*NSET, NSET=TIP",
            *(str(point + 1) for point in load.tip),
            *material_card(mu, body.alpha, body.bulk_modulus_mpa),
            "*SOLID SECTION, ELSET=ALL, MATERIAL=BODY",
            "*BOUNDARY",
            *held,
            "*STEP, NLGEOM, INC=1000",
            "*CONTROLS, PARAMETERS=FIELD",
            "0.005, 1.0",
            "*CONTROLS, PARAMETERS=TIME INCREMENTATION",
            "4, 12, 9, 20, 10, 4, , 8",
            "*STATIC",
            f"{first_increment:g}, 1.0, 1e-4, 1.0",
            "*DLOAD",
            *_pressures(load),
            "*NODE PRINT, NSET=TIP, FREQUENCY=1000",
            "U",
            "*END STEP",
            "",
        ]
    )


def run_finger(
    load: FingerLoad, element: str, first_increment: float, directory: Path, threads: int
) -> PeerRun:
    """Solve the load case in a directory, starting with a share of the load."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "finger.dat").unlink(missing_ok=True)
    (directory / "finger.inp").write_text(finger_deck(load, element, first_increment))
    usage = run_deck(directory, "finger", threads)
    log = (directory / "finger.log").read_text(errors="replace")
    iterations = len(re.findall(r"^ *iteration +\d", log, re.M))
    try:
        tip = printed(directory / "finger.dat")
    except (OSError, ValueError):
        times = re.findall(r"^ +\d+ +\d+ +\d+U? +\d+ +(\S+)", (directory / "finger.sta").read_text(), re.M)
        reached = float(times[-1]) if times else 0.0
        return PeerRun(usage, iterations, None, f"gave up at {reached:.0%} of the load")
    displacements = np.zeros(load.mesh.points.shape)
    for node, values in tip.items():
        displacements[node - 1] = values
    return PeerRun(usage, iterations, displacements)


def run_deck(directory: Path, name: str, threads: int = 1, limit_s: float = 3600.0) -> Usage:
    """Run `name.inp` of a directory; the output lies beside it in `name.log`."""
    environment = {"OMP_NUM_THREADS": str(threads)}
    return run_measured(["ccx", "-i", name], directory / f"{name}.log", directory, environment, limit_s)


def printed(path: Path) -> dict[int, list[float]]:
    """Node number to the values printed for it at the end of the step, at time 1.

    Raises ValueError when the file holds no such block.
    """
    blocks = re.split(r"^ .*and time +([0-9.E+-]+)$", path.read_text(), flags=re.M)
    if len(blocks) < 3 or abs(float(blocks[-2]) - 1.0) > 1e-6:
        raise ValueError(f"{path} holds no values at the end of the step")
    rows = [line.split() for line in blocks[-1].splitlines() if line.strip()]
    return {int(row[0]): [float(value) for value in row[1:]] for row in rows}


def _pressures(load: FingerLoad) -> Iterable[str]:
    block = load.mesh.blocks[0]
    faces = TETRAHEDRON_FACES if block.kind == "tetra10" else HEXAHEDRON_FACES
    found = corner_faces(block.nodes, faces)
    for hand, pressure in zip(HANDS, load.pressures, strict=True):
        for corners in corner_sets(load.mesh.facet_set(f"cavity_{hand}")):
            cell, face = found[corners]
            yield f"{cell + 1}, P{face + 1}, {pressure:.12g}"
