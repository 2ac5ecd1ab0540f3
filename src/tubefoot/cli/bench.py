"""Opening a bench for a verb: a real port or the simulated board, the rig file, the recorder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.operator import Operator
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.settings import RigSettings


@dataclass
class Bench:
    """A connected rig, whoever stands at it, and the recorder if there is one."""

    rig: BoardRig
    operator: Operator
    simulated: bool
    recorder: Recorder | None = None


def rig_settings(rig_file: Path | None, port: str | None) -> RigSettings:
    """The settings of a bench, its port replaced when one is given.

    rig_file : TOML file, None for the defaults
    port : serial port, None for that of the file
    """
    from tubefoot.config import load_settings
    from tubefoot.lab.settings import RigSettings

    settings = load_settings(rig_file, RigSettings) if rig_file else RigSettings()
    return settings if port is None else settings.on_port(port)


def recording_path(directory: Path) -> Path:
    """A name for a recording that is not taken: `bench.mcap`, `bench-2.mcap`, ...

    directory : of the run
    """
    from tubefoot.records import free_path

    return free_path(directory, "bench", ".mcap")


@contextmanager
def open_bench(
    settings: RigSettings, sim: bool, recording: Path | None = None, seed: int = 0, real_time: bool = False
) -> Iterator[Bench]:
    """A connected bench; on leaving, the pump is stopped and the recording closed.

    settings : of the rig
    sim : the nominal virtual bench with the real firmware, instead of the port
    recording : file to record into
    seed : of what is random on the virtual bench
    real_time : let the simulated bench run at the pace of the wall clock
    """
    from contextlib import ExitStack

    from tubefoot.lab.board_rig import BoardRig
    from tubefoot.lab.operator import Person
    from tubefoot.lab.port import Port, SerialPort
    from tubefoot.lab.recorder import Recorder

    with ExitStack() as stack:
        operator: Operator = Person()
        port: Port
        if sim:
            from tubefoot.twin.bench import VirtualBench
            from tubefoot.twin.simulated_operator import SimulatedOperator

            virtual = stack.enter_context(VirtualBench(seed=seed, rig_settings=settings, real_time=real_time))
            port = virtual.port
            operator = SimulatedOperator(virtual.plant)
        else:
            port = SerialPort(settings.board.port)
        recorder = None
        if recording is not None:
            recorder = Recorder(recording, settings, port.clock.now())
            stack.callback(recorder.close)
        rig = BoardRig(port, settings, recorder)
        stack.callback(rig.close)
        rig.connect()
        yield Bench(rig, operator, sim, recorder)
