"""Virtual experiments: the whole virtual bench runs a campaign and leaves a recording, its truth kept apart.

The finger of any length is made of the units of one identified finger. A blind experiment draws its bench by
a seed from the population of benches; what was drawn goes into a file of its own, `sealed/truth.toml`, that
no loader reads, and the hash of that file into `run.toml`: it can be opened later and cannot be changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from tubefoot.config import parse_settings, read_toml
from tubefoot.errors import ConfigError
from tubefoot.lab.board_rig import BoardRig
from tubefoot.lab.recorder import Recorder
from tubefoot.lab.sensing import measure_neutral
from tubefoot.lab.settings import RigSettings
from tubefoot.records import write_whole
from tubefoot.twin.bench import BoardKind, VirtualBench
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.twin.faults import BenchFault
from tubefoot.twin.population import drawn_bench
from tubefoot.validation.campaign import Campaign
from tubefoot.validation.campaign_run import CampaignRun, Ledger

SEALED = Path("sealed") / "truth.toml"
HIDDEN_FIRST = 50_000
"""Added to the seed of a blind bench: none is one of those that controllers are judged by."""
REFERENCE_UNITS = 12
"""Bubbles of the population are those of a finger of so many units."""


@dataclass(frozen=True)
class VirtualExperiment:
    """What a virtual experiment consists of.

    bench : what it is made of, the truth; units : of the finger, None for those of the bench's model
    campaign : what is done; seed : of noise, jitter and where the rollers stand; faults : what goes wrong
    """

    bench: BenchSettings
    units: int | None
    campaign: Campaign
    seed: int = 0
    faults: tuple[BenchFault, ...] = ()

    @property
    def made(self) -> BenchSettings:
        """The bench with a finger of that many units."""
        if self.units is None:
            return self.bench
        finger = self.bench.finger.model_copy(update={"units": self.units})
        return self.bench.model_copy(update={"finger": finger})


def hidden_bench(seed: int, units: int) -> BenchSettings:
    """The bench of a blind experiment, the same for ever.

    seed : 0 to 9999
    units : of the finger; bubbles are smaller in a shorter one, as its chambers are
    """
    if not 0 <= seed < 10_000:
        raise ConfigError(f"seed {seed} of a blind experiment: allowed are 0 to 9999")
    drawn = drawn_bench(HIDDEN_FIRST + seed)
    share, finger = units / REFERENCE_UNITS, drawn.finger
    bubbles = {
        f"bubble_{side}_ml": float(f"{share * getattr(finger, f'bubble_{side}_ml'):.6g}")
        for side in ("right", "left")
    }
    return drawn.model_copy(update={"finger": finger.model_copy(update={**bubbles, "units": units})})


def bonded_bench() -> BenchSettings:
    """The nominal bench with all the causes that the paper names: seam, bubbles, air columns, losses.

    The wall relaxes too. The same as examples/benches/bonded.toml.
    """
    table = {"finger": {"seam_stiffening": 0.15, "bubble_right_ml": 0.05, "bubble_left_ml": 0.05}}
    return parse_settings(table, BenchSettings, source="bonded bench")


def causeless_bench(units: int) -> BenchSettings:
    """The ideal bench: the nominal print without seam, creep, bubbles or air, and sensors without error.

    units : of the finger; what is left against finite elements is the error of the reduced finger

    The pump's leak stays; without air its pulses would meet a wall of water, so a microlitre is left.
    """
    return parse_settings(
        {
            "branches": {"air_right_ml": 0.0, "air_left_ml": 0.0, "tube_kpa_s_per_ml": 0.0},
            "finger": {
                "units": units,
                "creep": False,
                "seam_stiffening": 0.0,
                "bubble_right_ml": 0.0,
                "bubble_left_ml": 0.0,
            },
            "sensors": {"offset_right_v": 0.0, "offset_left_v": 0.0},
            "camera": {"angle_offset_deg": 0.0},
        },
        BenchSettings,
        source="ideal bench",
    )


def run_experiment(
    experiment: VirtualExperiment,
    directory: Path,
    board: BoardKind = "native",
    say: Callable[[str], None] = lambda _: None,
    rig_settings: RigSettings | None = None,
) -> Path:
    """The recording of a virtual experiment, or of the rest of an interrupted one.

    experiment : what to do
    directory : for recording and ledger
    board : `native`, the firmware's core on this computer with angles without pixels, or `simavr`, the real
        binary with rendered frames
    say : told of every block
    rig_settings : of the host's rig; the defaults if not given

    Raises ConfigError when the directory holds another campaign.
    """
    settings = rig_settings or RigSettings(name="virtual bench")
    experiment.campaign.demand_within(settings)
    ledger = Ledger.opened(directory, experiment.campaign)
    path = directory / f"bench{f'-{len(ledger.recordings) + 1}' if ledger.recordings else ''}.mcap"
    with _opened(experiment, settings, path, board) as session:
        units = experiment.made.finger.units
        CampaignRun(experiment.campaign, *session, say=say).run(ledger, directory, units)
    return path


def run_blind(
    seed: int,
    units: int,
    campaign: Campaign,
    directory: Path,
    board: BoardKind = "native",
    say: Callable[[str], None] = lambda _: None,
) -> tuple[Path, str]:
    """The recording of a blind experiment and the SHA-256 of its sealed truth.

    seed : of the bench and of all chance
    units : of the finger
    campaign : what is done
    directory : for the recording; the truth goes into `sealed/truth.toml` below it
    board : see `run_experiment`
    say : told of every block
    """
    bench = hidden_bench(seed, units)
    digest = seal(bench, directory, seed)
    return run_experiment(VirtualExperiment(bench, units, campaign, seed), directory, board, say), digest


def seal(bench: BenchSettings, directory: Path, seed: int) -> str:
    """SHA-256 of the file that holds the truth, after writing it.

    bench : the truth
    directory : of the run
    seed : by which it was drawn
    """
    content = tomli_w.dumps({"seed": seed, "bench": bench.model_dump(mode="json", exclude_none=True)})
    write_whole(directory / SEALED, content)
    return hashlib.sha256(content.encode()).hexdigest()


def unseal(directory: Path, digest: str | None = None) -> BenchSettings:
    """The truth of a blind experiment: to be opened when the fit is done.

    directory : of the run
    digest : SHA-256 from `run.toml`, checked if given

    Raises ConfigError when there is none, or when it was changed.
    """
    path = directory / SEALED
    table: dict[str, Any] = read_toml(path)
    if digest is not None and hashlib.sha256(path.read_bytes()).hexdigest() != digest:
        raise ConfigError(f"{path} is not the file that was sealed: its SHA-256 differs from run.toml's")
    return parse_settings(table["bench"], BenchSettings, source=str(path))


@contextmanager
def _opened(
    experiment: VirtualExperiment, settings: RigSettings, path: Path, board: BoardKind
) -> Iterator[tuple[Any, Recorder, Any]]:
    """Connected rig, recorder, open angles."""
    from tubefoot.vision.angles import TrackedAngles
    from tubefoot.vision.finger import FingerTracker

    with ExitStack() as stack:
        virtual = stack.enter_context(
            VirtualBench(experiment.made, experiment.seed, board, experiment.faults, settings)
        )
        recorder = Recorder(path, settings, virtual.clock.now())
        stack.callback(recorder.close)
        rig = BoardRig(virtual.port, settings, recorder)
        stack.callback(rig.close)
        rig.connect()
        angles: Any = virtual.angles
        if board == "simavr":
            angles = TrackedAngles(virtual.camera, FingerTracker(virtual.calibration, virtual.layout))
        angles.open()
        stack.callback(angles.close)
        measure_neutral(rig)
        yield rig, recorder, angles
