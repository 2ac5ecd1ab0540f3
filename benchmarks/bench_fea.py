"""The finger solved by us, by CalculiX and by FElupe: same load, equal accuracy of the bend angle.

The peers have no coupled chambers, so all programs get the pressures that our default solve finds at
P_right = 35 kPa, as follower pressures, and the angle is compared with a fine mesh of ours. The peers run on
the cheapest of the meshes tried (`python -m benchmarks.peers`) on which their error is no larger than ours.
Times are of whole processes, start and file reading included, Numba's cache being warm.
"""

import math
import tempfile
from pathlib import Path

from benchmarks.measured import Usage
from benchmarks.ours_fea import run_ours
from benchmarks.peers import DESIGN, PEERS, Peer, PeerResult
from benchmarks.row import Row

THREADS = 2
REFERENCE_MESH = "3/2"
OUR_MESH = "2"
UNITS = (3, 6, 12)


def run() -> list[Row]:
    with tempfile.TemporaryDirectory() as directory:
        root = Path(directory)
        solves = {units: _solve(units, root) for units in UNITS}
        rows = _solve_rows(solves)
        first = solves[3][1]
        load = (first["pressure_right_kpa"], first["pressure_left_kpa"])
        rows += _peer_rows(load, root)
        rows += _rate_rows(root)
        rows += _compile_rows(solves[3][0], root)
    return rows


def _solve(units: int, root: Path) -> tuple[Usage, dict]:
    """Our default solve to 35 kPa; the first one warms the cache."""
    design = DESIGN.with_name(f"reference-{units}.toml")
    if units == min(UNITS):
        run_ours(["solve", str(design), str(root / "warm")], root / "warm.log", THREADS)
    return run_ours(["solve", str(design), str(root / f"solve-{units}")], root / f"{units}.log", THREADS)


def _solve_rows(solves: dict[int, tuple[Usage, dict]]) -> list[Row]:
    """Time and memory of the coupled curve by number of units, and where the time goes."""
    rows = []
    for units, (usage, found) in solves.items():
        note = (
            f"{found['bend_deg']:.2f} deg, {found['states']} states, "
            f"{found['newton_iterations']} iterations, {found['unknowns']} unknowns, "
            f"CPU {usage.cpu_s:.1f} s, {usage.memory_mb:.0f} MB; {found['end_reason']}"
        )
        rows.append(Row(f"curve, {units} units, wall", usage.wall_s, None, "", None, "s", note))
    for few, many in ((3, 6), (6, 12)):
        growth = math.log(solves[many][0].wall_s / solves[few][0].wall_s) / math.log(many / few)
        rows.append(Row(f"time ~ units^x, {few} to {many}", growth, None, "", None, "x"))
    usage, found = solves[6]
    seconds = dict(found["seconds"])
    seconds["other (start, tables, pictures of fields)"] = usage.wall_s - sum(seconds.values())
    for name, value in seconds.items():
        share = f"{value / usage.wall_s:.0%}"
        rows.append(Row(f"of it, 6 units: {name}", value, None, "", None, "s", share))
    return rows


def _peer_rows(load: tuple[float, float], root: Path) -> list[Row]:
    """Ours beside each peer: error of the angle, CPU, wall, memory."""
    case = [str(value) for value in load]
    shares = sorted({peer.share for peer in PEERS})
    fine = ["pressures", str(DESIGN), REFERENCE_MESH, *case, *map(str, shares)]
    exact = dict(zip(shares, run_ours(fine, root / "fine.log", THREADS)[1]["bend_deg"], strict=True))
    rows = []
    for peer in PEERS:
        ours = run_ours(
            ["pressures", str(DESIGN), OUR_MESH, *case, str(peer.share)], root / "ours.log", THREADS
        )
        found = peer.run(load, root / peer.name.replace(" ", "-"), THREADS)
        rows += _beside(peer, ours, found, exact[peer.share])
    return rows


def _beside(peer: Peer, ours: tuple[Usage, dict], found: PeerResult, exact: float) -> list[Row]:
    usage, mine = ours
    errors = [100 * (bend / exact - 1.0) for bend in (mine["bend_deg"][0], found.bend_deg)]
    verdict = "" if abs(errors[1]) <= abs(errors[0]) else "; does not reach our accuracy"
    note = (
        f"of {exact:.3f} deg; {mine['unknowns']} against {found.unknowns} unknowns, "
        f"{mine['iterations']} against {found.iterations} iterations{verdict} {found.message}".rstrip()
    )
    what = f"3 units, given pressures x {peer.share:g}"
    numbers = [
        ("CPU", usage.cpu_s, found.usage.cpu_s, "s"),
        ("wall", usage.wall_s, found.usage.wall_s, "s"),
        ("memory", usage.memory_mb, found.usage.memory_mb, "MB"),
    ]
    return [
        Row(f"{what}, error of angle", *errors, peer.name, None, "%", note),
        *(Row(f"{what}, {key}", a, b, peer.name, b / a, unit) for key, a, b, unit in numbers),
    ]


def _rate_rows(root: Path) -> list[Row]:
    """Rate of the numerical factorisation beside a dense product, on the 3- and 12-unit fingers."""
    rows = []
    for units in (3, 12):
        design = DESIGN.with_name(f"reference-{units}.toml")
        _, found = run_ours(["rates", str(design), OUR_MESH], root / f"rates-{units}.log", THREADS)
        ours, dense = found["factor_gflops"], found["dense_gflops"]
        note = f"{found['gflop']:.2f} GFLOP a factorisation"
        name = f"factorisation rate, {units} units"
        rows.append(Row(name, ours, dense, "dense product", ours / dense, "GFLOP/s", note))
    return rows


def _compile_rows(warm: Usage, root: Path) -> list[Row]:
    """What the very first solve on a machine waits for the compiler, kept in a cache afterwards."""
    command = ["solve", str(DESIGN), str(root / "cold")]
    usage, _ = run_ours(command, root / "cold.log", THREADS, NUMBA_CACHE_DIR=str(root / "numba"))
    wait = usage.wall_s - warm.wall_s
    return [Row("first solve ever: compiling", wait, None, "", None, "s", "wall, once a machine")]
