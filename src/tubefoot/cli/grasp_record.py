"""What a grasp leaves behind: trace, summary, pictures of its phases, video, verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    import numpy as np
    from numpy.typing import NDArray

    from tubefoot.cli.grasp_stage import GraspStage
    from tubefoot.control.grasp_loop import GraspLoop
    from tubefoot.control.grasp_protocol import GraspProtocol
    from tubefoot.control.grasp_settings import GraspSettings
    from tubefoot.lab.grasp_object import GraspObject, Pose
    from tubefoot.records import Run

SIDES = ("right", "left")
VIDEO_S = 0.1
"""One picture of the video for so much bench time [s]."""
ANGLES = ("theta1", "theta2", "theta1_chord", "theta2_chord")
SHOWN = ("close", "grip", "settle", "hold", "shake", "let go")
"""Phases whose first picture goes into the strip."""


class Spectator:
    """Takes pictures of a grasp while it runs, and says what happens."""

    def __init__(
        self, directory: Path, picture: Callable[[str], NDArray[np.uint8]] | None, say: Callable[[str], None]
    ):
        """Begin.

        directory : of the run; picture : what is seen, None where nothing can be; say : told of each phase
        """
        self._directory, self._picture, self._say = directory, picture, say
        self._phase = ""
        self._next = 0.0
        self._video: Any = None
        self._kept: list[str] = []

    def watch(self, row: dict[str, Any]) -> None:
        """Look at one row of the trace.

        row : the newest
        """
        if row["phase"] != self._phase:
            self._say(f"{row['time_s']:7.2f} s  {row['phase']:<8} {phase_line(row)}")
        if self._picture is not None and (row["time_s"] >= self._next or row["phase"] != self._phase):
            self._next = row["time_s"] + VIDEO_S
            picture = self._picture(f"{row['time_s']:.1f} s  {row['phase']}   {phase_line(row)}")
            self._film(picture)
            if row["phase"] != self._phase and row["phase"] in SHOWN:
                self._keep(row["phase"], picture)
        self._phase = row["phase"]

    def close(self) -> None:
        """End the video."""
        if self._video is not None:
            self._video.release()

    def _film(self, picture: NDArray[np.uint8]) -> None:
        import cv2

        if self._video is None:
            height, width = picture.shape[:2]
            code = cv2.VideoWriter_fourcc(*"MJPG")  # type: ignore[attr-defined]
            self._video = cv2.VideoWriter(
                str(self._directory / "grasp.avi"), code, 1 / VIDEO_S, (width, height)
            )
        self._video.write(picture)

    def _keep(self, phase: str, picture: NDArray[np.uint8]) -> None:
        import cv2

        if phase not in self._kept:
            self._kept.append(phase)
            name = f"{len(self._kept)}-{phase}.png".replace(" ", "-")
            folder = self._directory / "phases"
            folder.mkdir(exist_ok=True)
            cv2.imwrite(str(folder / name), picture)


def phase_line(row: Mapping[str, Any]) -> str:
    """Angles, forces and pulses in one line.

    row : of the trace
    """
    theta1, theta2 = (_mean(row[f"{name}_{side}_deg"] for side in SIDES) for name in ("theta1", "theta2"))
    force = _mean(row[f"force_{side}_n"] for side in SIDES)
    return f"theta1 {theta1:+.1f}  theta2 {theta2:+.1f} deg  grip {force:.3f} N  in {row['inward_pulses']}"


def carry_out(
    run: Run,
    stage: AbstractContextManager[GraspStage],
    thing: GraspObject,
    pose: Pose,
    settings: GraspSettings,
    coupled: bool,
    seed: int | None,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """The summary of a grasp, after everything is written.

    run : its directory; stage : to be opened; thing, pose : what is grasped; settings : of the grasp
    coupled : one pump for both fingers; seed : None on the real bench; say : told of each phase
    """
    from tubefoot.control.grasp_loop import GraspLoop
    from tubefoot.control.grasp_protocol import GraspProtocol
    from tubefoot.records import write_json, write_table
    from tubefoot.reduced.files import reference_file
    from tubefoot.report.grasping import draw_grasp

    content = reference_file()
    finger, memory = content.to_finger(), content.to_prony()
    protocol = GraspProtocol(thing, pose, finger, settings, coupled, memory)
    if not protocol.goal.within_bounds:
        say(
            f"note: a grip of {protocol.goal.force:.3f} N is wanted against slip, but {thing.name} bears no "
            f"more than {protocol.goal.most:.3f} N with the wanted margin"
        )
    with stage as opened:
        spectator = Spectator(run.directory, opened.picture, say)
        loop = GraspLoop(opened.rigs, opened.angles, opened.hands, spectator.watch, opened.further)
        loop.run(protocol)
        spectator.close()
        if loop.rows:
            write_table(run.path("grasp.csv"), loop.rows)
        verdict = opened.verdict()
    summary = grasp_summary(thing, pose, protocol, loop, verdict, seed)
    write_json(run.path("summary.json"), summary)
    if loop.rows:
        draw_grasp(run.directory)
    run.finish()
    return summary


def tell(summary: Mapping[str, Any]) -> None:
    """Print a summary and its verdict.

    summary : of a grasp
    """
    for key, value in summary.items():
        print(f"{key:<30} {value:.4g}" if isinstance(value, float) else f"{key:<30} {value}")
    print(verdict_sentence(summary))


def raise_for(reason: str) -> None:
    """Raise what the end of a grasp stands for, for the exit code.

    reason : why it ended
    """
    from tubefoot.errors import ConvergenceError, LinkError, SafetyStop

    if reason.startswith("interrupted"):
        raise KeyboardInterrupt
    if reason.startswith("link lost"):
        raise LinkError(reason)
    if reason.startswith("safety stop"):
        raise SafetyStop(reason)
    if reason.startswith(("no contact", "the fingers did not open", "held back")):
        raise ConvergenceError(reason)


def grasp_summary(
    thing: GraspObject,
    pose: Pose,
    protocol: GraspProtocol,
    loop: GraspLoop,
    verdict: Mapping[str, Any],
    seed: int | None,
) -> dict[str, Any]:
    """The keys of summary.json.

    thing, pose : what was grasped; protocol : that has ended; loop : with its trace
    verdict : what the hands say; seed : None on the real bench

    Angles are means over the last second of the hold and over both fingers; `*_contact` the same when contact
    was sure. Forces that nobody measured are the protocol's estimates.
    """
    from tubefoot.control.contact_type import classify_contact
    from tubefoot.control.damage import damage_of
    from tubefoot.units import DEG

    outcome, rows = protocol.outcome, loop.rows
    touched = verdict.get("first_touch_s")
    held = [row for row in rows if row["phase"] == "hold"]
    at_end = held[-30:]
    sure = _contact_rows(rows)
    angles = {f"{name}_deg": _over(at_end, name) for name in ANGLES}
    angles |= {f"{name}_contact_deg": _over(sure, name) for name in ANGLES[:2]}
    force = float(verdict.get("peak_force_n", max(outcome.grip_force)))
    damage = damage_of(thing, pose, force, verdict.get("peak_crest_force_n"))
    kind = classify_contact(angles["theta1_deg"] * DEG, angles["theta2_deg"] * DEG)
    early = classify_contact(angles["theta1_contact_deg"] * DEG, angles["theta2_contact_deg"] * DEG)
    return {
        "object": thing.name,
        "pose": pose,
        "seed": seed,
        "held": verdict.get("held", False),
        "slip_mm": verdict.get("slip_mm"),
        "peak_pressure_kpa": damage.pressure_kpa,
        "damage_margin": damage.margin,
        "nearest_bound": damage.nearest,
        "damage_margins": damage.margins,
        "compression_kpa": damage.compression_kpa,
        "local_compression_kpa": damage.local_kpa,
        "local_margin": damage.local_margin,
        **angles,
        "contact_type": kind.kind,
        "contact_confidence": kind.confidence,
        "contact_type_at_contact": early.kind,
        "contact_confidence_at_contact": early.confidence,
        "pulses_outward": outcome.outward_pulses,
        "pulses_inward": outcome.inward_pulses,
        "pulses_after_contact": outcome.grip_pulses,
        "pulses_in_hold": outcome.keep_pulses,
        "contact_pulse": outcome.contact_pulse,
        "grip_force_estimated_n": min(outcome.grip_force),
        "grip_force_goal_n": protocol.goal.force,
        "peak_force_n": force,
        "bench_time_s": rows[-1]["time_s"] if rows else 0.0,
        "detection_latency_pulses": loop.latencies(protocol, touched) if touched else None,
        **{key: value for key, value in verdict.items() if key in ("damage_seen", "first_touch_s")},
        "end_reason": outcome.reason,
    }


def verdict_sentence(summary: Mapping[str, Any]) -> str:
    """The verdict in a sentence.

    summary : of a grasp
    """
    if summary["held"] is None:
        return f"verdict: not given, nobody said whether it was held ({summary['end_reason']})"
    if not summary["held"]:
        return f"verdict: NOT held ({summary['end_reason']})"
    slip = summary["slip_mm"]
    moved = "slip not measured" if slip is None else f"slip {slip:.2f} mm"
    margin = summary["damage_margin"]
    bound = "within" if margin >= 1 else "BEYOND"
    nearest = f"bound over load {margin:.1f}, {summary['nearest_bound']}"
    local = summary.get("local_margin", math.inf)
    under = f"; under a crest {1 / local:.1f} times the stress that it is known to bear" if local < 1 else ""
    return f"verdict: held, {moved}, {bound} the damage bounds ({nearest}){under}"


def _contact_rows(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Rows of the pause in which contact of both fingers became sure."""
    for index, row in enumerate(rows):
        if row["touching_right"] and row["touching_left"]:
            return list(rows[max(0, index - 8) : index + 1])
    return []


def _over(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    return _mean(row[f"{name}_{side}_deg"] for row in rows for side in SIDES)


def _mean(values: Any) -> float:
    known = [value for value in values if math.isfinite(value)]
    return sum(known) / len(known) if known else math.nan
