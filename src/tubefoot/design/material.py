"""Materials as settings: what a design file says about the soft body, the rigid parts and the seam."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from tubefoot.config import Settings
from tubefoot.design.relaxation import agilus30_relaxation


class OgdenMaterial(Settings):
    """Nearly incompressible Ogden solid.

    W = sum_i 2 mu_i / alpha_i^2 (sum_k l_k^alpha_i - 3) + U(J) with isochoric principal stretches l_k and
    U = bulk / 2 (J - 1)^2 near J = 1 (docs/theory.md); the initial shear modulus is sum mu_i. Other
    programs write mu_i / alpha_i, or c_i / m_i^2 with c_i = 2 mu_i: convert before copying numbers.
    """

    name: str = "Agilus30"
    """Name in files and bills."""
    mu_mpa: tuple[float, ...] = (0.2127, 0.0375, -0.001)
    """Ogden moduli mu_i [MPa]; default Agilus30 quasi-static, Abayazid and Ghajari 2020, as in the paper."""
    alpha: tuple[float, ...] = (1.3212, 4.318, -1.0248)
    """Ogden exponents alpha_i [-]."""
    bulk_modulus_mpa: Annotated[float, Field(gt=0, le=1e5)] = 50.0
    """Bulk modulus [MPa]; ours, chosen so that J stays within 1 % at the pressures of the paper."""
    scale: Annotated[float, Field(ge=0.05, le=20.0)] = 1.0
    """Factor on the moduli mu_i, per print: 0.4 to 1.7 is the spread seen in the literature."""
    density_g_per_cm3: Annotated[float, Field(ge=0.5, le=5.0)] = 1.145
    """Density of the printed material."""
    elongation_at_break_percent: Annotated[float, Field(gt=0, le=2000)] = 220.0
    """Nominal strain at rupture [%]; the maker's sheet says 220 to 270, from memory."""
    relaxation_time_s: tuple[Annotated[float, Field(gt=0.0)], ...] = agilus30_relaxation()[0]
    """Relaxation times of the viscoelastic terms [s]; used by solves in time only."""
    relaxation_share: tuple[Annotated[float, Field(ge=0.0)], ...] = agilus30_relaxation()[1]
    """Modulus of each of these terms over the long-term modulus; default Agilus30 at 20 deg C, small strains,
    fitted to a published dynamic test (design/data)."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.mu_mpa) != len(self.alpha) or not self.mu_mpa:
            raise ValueError(
                f"{len(self.mu_mpa)} moduli mu_mpa and {len(self.alpha)} exponents alpha; "
                "give as many of each, at least one"
            )
        if any(exponent == 0.0 for exponent in self.alpha):
            raise ValueError("an Ogden exponent alpha is 0; leave that term out")
        if self.shear_modulus <= 0:
            raise ValueError(
                f"initial shear modulus sum mu_i = {self.shear_modulus:g} MPa is not positive; "
                "check the signs"
            )
        if len(self.relaxation_time_s) != len(self.relaxation_share):
            raise ValueError(
                f"{len(self.relaxation_time_s)} times relaxation_time_s and {len(self.relaxation_share)} "
                "moduli relaxation_share; give as many of each"
            )
        if self.bulk_modulus_mpa < 10 * self.shear_modulus:
            raise ValueError(
                f"bulk modulus {self.bulk_modulus_mpa:g} MPa is under 10 times the shear modulus "
                f"{self.shear_modulus:g} MPa, so the material is not nearly incompressible; "
                "raise bulk_modulus_mpa"
            )
        return self

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus, scaled [MPa]."""
        return self.scale * sum(self.mu_mpa)


class ElasticMaterial(Settings):
    """Stiff isotropic solid."""

    name: str = "Vero"
    """Name in files and bills."""
    youngs_modulus_mpa: Annotated[float, Field(gt=0, le=1e6)] = 2200.0
    """Young's modulus [MPa]; the maker's sheet says 2000 to 2500."""
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.495)] = 0.35
    """Ratio of lateral to axial strain."""
    density_g_per_cm3: Annotated[float, Field(ge=0.5, le=20.0)] = 1.18
    """Density of the printed material."""
    tensile_strength_mpa: Annotated[float, Field(gt=0)] = 40.0
    """Tensile strength [MPa]; the maker's sheet says 40 to 55."""


class Seam(Settings):
    """The bonded mid-plane y = 0: a thin film of UV resin, ideal (no film) unless it is given a modulus."""

    thickness_mm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.15
    """Thickness of the film; 0.1 to 0.2 is what a brush leaves."""
    modulus_mpa: Annotated[float, Field(ge=0.0, le=1e4)] = 0.0
    """Young's modulus of the film [MPa]; 0 means the ideal seam. Unknown for a print: identify it."""
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.4
    """Ratio of lateral to axial strain of the film."""
    bond_strength_mpa: Annotated[float, Field(gt=0.0)] | None = None
    """Tensile strength of the bond [MPa]; no source has one for these materials, so margins stay empty until
    one is measured and given here."""
