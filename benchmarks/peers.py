"""The peers, and the study that chose their elements and meshes.

`python -m benchmarks.peers RIGHT_KPA LEFT_KPA [PROGRAM FORM MESH RAMP SHARE]` prints angle, time and
memory of every entry of `STUDY`, or of the one that is named.
"""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks import peers_calculix, peers_felupe
from benchmarks.finger_load import load_case
from benchmarks.measured import Usage

DESIGN = Path("examples/designs/reference-3.toml")


@dataclass(frozen=True)
class PeerResult:
    """A peer's run: what it took, the tip's angle [deg] (nan when it gave up), iterations, unknowns."""

    usage: Usage
    bend_deg: float
    iterations: int
    unknowns: int
    message: str


@dataclass(frozen=True)
class Peer:
    """A program with its element form, mesh (see `divisions_named`) and ramp.

    ramp : the first increment for CalculiX, which chooses the others; the number of equal ones for FElupe
    share : of the load, where the whole of it is out of its reach
    """

    program: str
    form: str
    mesh: str
    ramp: float
    share: float = 1.0

    @property
    def name(self) -> str:
        return f"{self.program} {self.form}"

    def run(self, pressures_kpa: tuple[float, float], directory: Path, threads: int) -> PeerResult:
        """Solve the load case in a directory of its own."""
        program = {"CalculiX": peers_calculix, "FElupe": peers_felupe}[self.program]
        right, left = (self.share * pressure for pressure in pressures_kpa)
        load = load_case(DESIGN, self.mesh, program.KINDS[self.form], (right, left))
        found = program.run_finger(load, self.form, self.ramp, directory, threads)
        bend = float("nan") if found.displacements is None else load.bend_deg(found.displacements)
        return PeerResult(found.usage, bend, found.iterations, int((~load.held).sum()), found.message)


PEERS = (
    Peer("CalculiX", "C3D20R", "1.5", 0.25, share=0.5),
    Peer("FElupe", "hexahedron27", "1.5", 4),
)
"""What `bench_fea` runs."""

STUDY = (
    Peer("CalculiX", "C3D10", "2", 0.1),
    Peer("CalculiX", "C3D20", "2", 0.1),
    Peer("CalculiX", "C3D20R", "2", 0.1),
    Peer("CalculiX", "C3D20R", "1.5", 0.1),
    Peer("CalculiX", "C3D10", "2", 0.25, share=0.5),
    Peer("CalculiX", "C3D20R", "2", 0.25, share=0.5),
    Peer("CalculiX", "C3D20R", "1.5", 0.25, share=0.5),
    Peer("FElupe", "hexahedron8", "1", 4),
    Peer("FElupe", "hexahedron27", "3", 4),
    Peer("FElupe", "hexahedron27", "2", 4),
    Peer("FElupe", "hexahedron27 continuous", "3", 4),
    Peer("FElupe", "hexahedron27 continuous", "2", 4),
)
"""What the choice was made from."""


def main(arguments: list[str]) -> None:
    load = (float(arguments[0]), float(arguments[1]))
    named = arguments[2:]
    peers = [Peer(named[0], named[1], named[2], *map(float, named[3:]))] if named else STUDY
    print(
        "| program, element | mesh | ramp | load | unknowns | angle deg | iterations | CPU s | wall s | MB |"
    )
    for peer in peers:
        with tempfile.TemporaryDirectory() as directory:
            found = peer.run(load, Path(directory), threads=2)
        used = found.usage
        print(
            f"| {peer.name} | {peer.mesh} | {peer.ramp:g} | {peer.share:.0%} | {found.unknowns} | "
            f"{found.message or format(found.bend_deg, '.3f')} | {found.iterations} | {used.cpu_s:.0f} | "
            f"{used.wall_s:.0f} | {used.memory_mb:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
