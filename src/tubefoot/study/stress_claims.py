"""The paper's claims about where stress lies (C2, C8), judged by the hottest 5 % of the body's volume.

Peaks at sharp edges depend on the mesh, volumes hardly: see `fea.hotspots`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from tubefoot.study.claims import Claim, verdict_of
from tubefoot.study.curve import Curve

CENTRAL = ("partition", "valley_right", "valley_left")
FOLDS = ("fold_right", "fold_left")

CONCENTRATED = 1.5
"""Share of the hottest volume over the share of the volume from which a stress concentrates in a zone."""

Zones = Mapping[str, Mapping[str, Any]]


def share(zones: Zones, names: Iterable[str], column: str = "hottest_share") -> float:
    """Sum of a share over some zones.

    zones : rows of hotspots.csv by zone; names : which; column : hottest_share or volume_share
    """
    return sum(float(zones[name][column]) for name in names if name in zones)


def concentration(zones: Zones, names: Iterable[str]) -> float:
    """Share of the hottest volume over the share of the volume of some zones.

    zones : rows of hotspots.csv by zone; names : which
    """
    chosen = list(names)
    return share(zones, chosen) / share(zones, chosen, "volume_share")


def judge_concentration(curves: Mapping[str, Curve]) -> Claim:
    """C2: 3/9 concentrates stress in the central body, 3/15 spreads it over the folds.

    curves : pitch ("3/15", "3/9", others for the record) to its curve
    """
    found = {pitch: curve.hotspots("von_mises") for pitch, curve in curves.items()}
    found = {pitch: zones for pitch, zones in found.items() if zones}
    numbers: dict[str, float] = {}
    central = {pitch: share(zones, CENTRAL) for pitch, zones in found.items()}
    folds = {pitch: share(zones, FOLDS) for pitch, zones in found.items()}
    for pitch in found:
        numbers |= {f"central_share_{pitch}": central[pitch], f"fold_share_{pitch}": folds[pitch]}
    parts = []
    if {"3/15", "3/9"} <= found.keys():
        parts = [
            central["3/9"] > folds["3/9"],
            central["3/15"] < central["3/9"] and folds["3/15"] > folds["3/9"],
        ]
    return Claim(
        "C2",
        "3/9 concentrates stress in the central body, 3/15 spreads it over the folds",
        "of the 5 % of the volume with the highest von Mises stress at 35 kPa, 3/9 has more in partition and "
        "valleys than in the folds; 3/15 has less there and more in the folds than 3/9",
        verdict_of(parts),
        numbers,
        "regions",
    )


def judge_components(curve: Curve) -> Claim:
    """C8: where S23, S13 and S33 lie, and what the seam bears.

    curve : of the reference finger
    """
    stresses = {name: curve.hotspots(name) for name in ("s23", "s13", "s33")}
    seam = curve.seam()
    parts: list[bool] = []
    numbers: dict[str, float] = {}
    if all(stresses.values()) and seam:
        found = {
            "s23_in_folds": concentration(stresses["s23"], FOLDS),
            "s13_in_partition": concentration(stresses["s13"], ["partition"]),
            "s13_near_mid_plane": concentration(stresses["s13"], ["near_mid_plane"]),
        }
        parts = [value >= CONCENTRATED for value in found.values()]
        parts.append(float(seam["right"]["s33_p99_kpa"]) > 0 and float(seam["right"]["opening_force_n"]) > 0)
        numbers = {f"concentration_{name}": value for name, value in found.items()}
        for name, zones in stresses.items():
            numbers |= _peak(name, zones)
        for hand in ("right", "left"):
            for column in ("opening_force_n", "peeling_moment_n_mm", "s33_p99_kpa"):
                numbers[f"seam_{hand}_{column}"] = float(seam[hand][column])
        numbers["seam_partition_s33_p99_kpa"] = float(seam["partition"]["s33_p99_kpa"])
        numbers["seam_s13_p99_kpa"] = float(seam["all"]["s13_p99_kpa"])
    return Claim(
        "C8",
        "S23 concentrates along the fold walls, S13 at the mid-plane and partition, S33 across the seam",
        "at 35 kPa, of the 5 % of the volume with the highest stress, 1.5 times their share of the volume "
        "lies in the folds for S23, in the partition and in the quarter of the height about the mid-plane "
        "for S13; S33 pulls on the seam (99th percentile) and opens it on the pressurised side",
        verdict_of(parts),
        numbers,
        "seam",
    )


def _peak(name: str, zones: Zones) -> dict[str, float]:
    """Size and place of a stress's largest value in the body."""
    top = max(zones.values(), key=lambda row: float(row["peak_kpa"]))
    columns = ("peak_kpa", "peak_x_mm", "peak_y_mm", "peak_z_mm")
    return {f"{name}_{column}": float(top[column]) for column in columns}
