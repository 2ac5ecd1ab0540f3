"""The relaxation of Agilus30 that ships with the package: Prony times and moduli over the long-term one."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files

RELAXATION_FILE = "agilus30_relaxation.csv"


@cache
def agilus30_relaxation() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Relaxation times [s] and each term's modulus over the long-term modulus [-].

    Source: `design/data/README.md`; 20 deg C, small strains, terms from 0.1 s on.
    """
    text = (files("tubefoot.design") / "data" / RELAXATION_FILE).read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    long_term = next(float(row["modulus_mpa"]) for row in rows if row["term"] == "inf")
    terms = [row for row in rows if row["term"] != "inf"]
    times = tuple(float(row["tau_s"]) for row in terms)
    return times, tuple(round(float(row["modulus_mpa"]) / long_term, 4) for row in terms)
