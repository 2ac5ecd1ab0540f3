"""`tubefoot rig record --campaign`: a bench campaign, real, virtual or blind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tubefoot.lab.settings import RigSettings
    from tubefoot.records import Run
    from tubefoot.twin.bench import BoardKind
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.validation.campaign import Campaign


@dataclass(frozen=True)
class CampaignOptions:
    """On which finger, with which camera, or on which virtual bench a campaign is run."""

    units: Annotated[int | None, Parameter(help="campaign: units of the finger")] = None
    camera: Annotated[Path | None, Parameter(help="campaign: camera.toml; no angles without it")] = None
    source: Annotated[str, Parameter(help="campaign: webcam, by number or device")] = "0"
    layout: Annotated[Path | None, Parameter(help="campaign: marker layout (TOML)")] = None
    bench: Annotated[Path | None, Parameter(help="campaign: TOML of the virtual bench")] = None
    population: Annotated[
        int | None, Parameter(help="campaign: virtual bench of the population drawn by this seed")
    ] = None
    blind: Annotated[
        int | None, Parameter(help="campaign: hidden virtual bench of this seed, its truth sealed in a file")
    ] = None
    quick: Annotated[
        bool, Parameter(help="campaign: no pixels, the firmware's core on this computer", negative="")
    ] = False


NO_OPTIONS = CampaignOptions()


def run_campaign(
    path: Path, options: CampaignOptions, settings: RigSettings, seed: int | None, out: Path
) -> None:
    """Run a campaign, or what is left of it, and say how to compare its recording.

    path : TOML of the campaign
    options : finger, camera, virtual bench
    settings : of the rig
    seed : of chance on the virtual bench, None for a real one
    out : directory for recording, ledger and run.toml
    """
    from tubefoot.records import Run
    from tubefoot.validation.campaign import load_campaign
    from tubefoot.validation.campaign_run import Ledger

    _demand_consistent(options, seed)
    campaign = load_campaign(path)
    campaign.demand_within(settings)
    ledger = Ledger.opened(out, campaign)
    if ledger.repeats >= campaign.repeats:
        print(f"all {campaign.repeats} repeats of `{campaign.name}` are done: {out}")
        return
    if ledger.recordings:
        print(f"{ledger.repeats} of {campaign.repeats} repeats are done; going on")
    about: dict[str, Any] = {
        "sim": seed is not None,
        "campaign": campaign.model_dump(mode="json"),
        "rig": settings.model_dump(mode="json"),
        "units": options.units,
        "blind_seed": options.blind,
    }
    run = Run(out, "rig record", about, seed=seed)
    try:
        if seed is None:
            recording = _record_real(campaign, settings, options, run.directory)
        else:
            recording = _record_virtual(campaign, settings, options, seed, run)
    finally:
        run.finish()
    print(f"recording: {recording}")
    print(f"compare it: tubefoot validate {recording} --against out/reference-{options.units or 12}")
    print(f"results: {run.directory}")


def _demand_consistent(options: CampaignOptions, seed: int | None) -> None:
    from tubefoot.errors import ConfigError

    virtual = {"--bench": options.bench, "--population": options.population, "--blind": options.blind}
    chosen = [name for name, value in virtual.items() if value is not None]
    if len(chosen) > 1:
        raise ConfigError(f"{' and '.join(chosen)} each say what the virtual bench is; give one of them")
    if seed is None and (chosen or options.quick):
        raise ConfigError(f"{chosen[0] if chosen else '--quick'} goes with --sim")
    if options.blind is not None and options.units is None:
        raise ConfigError("--blind needs --units: the sealed bench has a finger of that many units")


def _record_virtual(
    campaign: Campaign, settings: RigSettings, options: CampaignOptions, seed: int, run: Run
) -> Path:
    """The recording of a session on the virtual bench."""
    from tubefoot.validation.virtual_experiment import VirtualExperiment, hidden_bench, run_experiment, seal

    if options.blind is not None:
        assert options.units is not None
        bench, seed = hidden_bench(options.blind, options.units), options.blind
        digest = seal(bench, run.directory, options.blind)
        run.settings = {**run.settings, "sealed_truth_sha256": digest}
        print(f"truth sealed in {run.directory / 'sealed'}; its SHA-256 is in run.toml")
    else:
        bench = _bench(options)
        run.settings = {**run.settings, "bench": bench.model_dump(mode="json")}
    experiment = VirtualExperiment(bench, options.units, campaign, seed)
    board: BoardKind = "native" if options.quick else "simavr"
    return run_experiment(experiment, run.directory, board, _say, settings)


def _bench(options: CampaignOptions) -> BenchSettings:
    from tubefoot.config import load_settings
    from tubefoot.twin.bench_settings import BenchSettings
    from tubefoot.twin.population import drawn_bench

    if options.population is not None:
        return drawn_bench(options.population)
    return load_settings(options.bench, BenchSettings) if options.bench else BenchSettings()


def _record_real(
    campaign: Campaign, settings: RigSettings, options: CampaignOptions, directory: Path
) -> Path:
    """The recording of a session on a port; without a camera it holds pressures only."""
    from tubefoot.cli.bench import open_bench, recording_path
    from tubefoot.cli.bend_stage import real_stage
    from tubefoot.lab.sensing import measure_neutral
    from tubefoot.validation.campaign_run import CampaignRun, Ledger

    path, ledger = recording_path(directory), Ledger.opened(directory, campaign)
    if options.camera is not None:
        with real_stage(settings, path, options.source, options.camera, options.layout) as stage:
            session = CampaignRun(campaign, stage.rig, stage.recorder, stage.angles, _say)
            session.run(ledger, directory, options.units)
        return path
    print("no --camera: pressures only, no angles")
    with open_bench(settings, False, path) as bench:
        measure_neutral(bench.rig)
        assert bench.recorder is not None
        CampaignRun(campaign, bench.rig, bench.recorder, None, _say).run(ledger, directory, options.units)
    return path


def _say(text: str) -> None:
    print(text, flush=True)
