"""CalculiX (`ccx`): runs of the product's decks of the load case, and the displacements that it found.

Convergence is judged by its default residual of 0.5 % of the mean force alone, see `tubefoot.fea.deck`.
"""

import re
import shutil
from pathlib import Path

import numpy as np

from benchmarks.finger_load import FingerLoad, PeerRun
from benchmarks.measured import Usage, run_measured
from tubefoot.fea.deck import DeckLoad, finger_deck

KINDS = {"C3D20": "hexahedron20", "C3D20R": "hexahedron20", "C3D8I": "hexahedron8", "C3D10": "tetra10"}
"""Its elements, and the cells of ours that have their nodes, in the same order."""


def available() -> bool:
    return shutil.which("ccx") is not None


def run_finger(
    load: FingerLoad, element: str, first_increment: float, directory: Path, threads: int
) -> PeerRun:
    """Solve the load case in a directory, starting with a share of the load."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "finger.dat").unlink(missing_ok=True)
    (directory / "finger.inp").write_text(_deck(load, element, first_increment))
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


def _deck(load: FingerLoad, element: str, first_increment: float) -> str:
    on_chambers = DeckLoad(load.pressures, first_increment=first_increment)
    return finger_deck(load.design, load.mesh, element, on_chambers)


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
