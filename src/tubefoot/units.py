"""Units: the inside is mm, N, s, MPa, rad (so mm^3 and N mm = mJ); every edge names its own unit.

Convert once, at the edge, by multiplying on the way in and dividing on the way out:

>>> 35 * KPA          # a pressure read from a file, now in MPa
0.035
>>> round(0.35 * ML)  # a pumped volume, now in mm^3
350
>>> round(0.5236 / DEG, 2)
30.0
"""

from math import pi

PA = 1e-6
KPA = 1e-3
MPA = 1.0
GPA = 1e3
ML = 1e3
DEG = pi / 180.0
GRAM_PER_CM3 = 1e-9
"""Density in t/mm^3, the mass unit that goes with N, mm and s."""

ATMOSPHERE_MPA = 0.101325
"""Standard atmosphere [MPa]; the gauge pressure of absolute vacuum is its negative."""

STANDARD_GRAVITY = 9806.65
"""[mm/s^2]"""
