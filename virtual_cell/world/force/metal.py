"""Work material: how hard it is from place to place and from run to run, and how an edge parts it.

Shear follows strain-gradient plasticity (Joshi and Melkote, J. Manuf. Sci. Eng. 126 (2004) 679): the flow
stress goes as sqrt(1 + l/h), h the chip and l a length of the metal. Chips thinner than the rounding of the
edge are ploughed under instead of cut.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_signed, drawn_size
from virtual_cell.units import N_MM, N_MM2, UM, Array


@dataclass(frozen=True)
class Metal:
    """A metal under a sharp edge.

    Attributes
    ----------
    shear : (3,) N/m², tangential, radial, axial at the chip ``reference`` (m). edge : (3,) N/m along the
        edge.
    bottom : N/m² and N/m, of the edges at the tool's bottom. bottom_drag : tangential over axial force there.
    length : of the strain gradient, m. contact : chip at which the edge rubs with two thirds of its force, m.
    plough, least_chip : extra edge force, as a share, about the chip (m) that is only just cut.
    common, own, drift : shares: of a factor of all coefficients from run to run, of one of each, and of what
        they have changed at the end of a session.
    bar, bar_from : by how much a second bar is harder, as a share, and after what share of the session.
    """

    shear: Array
    edge: Array
    bottom: tuple[float, float]
    bottom_drag: float = 0.4
    reference: float = 5e-5
    length: float = 0.0
    contact: float = 1e-7
    plough: float = 0.0
    least_chip: float = 2e-6
    common: float = 0.0
    own: float = 0.0
    drift: float = 0.0
    bar: float = 0.0
    bar_from: float = 1.0

    def cutting(self, h: Array) -> Array:
        """Chip thickness (m) times the factor on the shear coefficients, where it is ``h``; none in air."""
        cut = np.maximum(h, 0.0)
        return np.asarray(np.sqrt(cut * (cut + self.length)) / math.sqrt(1.0 + self.length / self.reference))

    def rubbing(self, h: Array) -> Array:
        """Factor on the edge coefficients at chip thickness ``h`` (m)."""
        cut = np.maximum(h, 0.0)
        part = cut / self.least_chip
        bump = self.plough * part * np.exp(1.0 - part)
        return np.asarray(1.0 - np.exp(-cut / self.contact) + bump)


def drawn_metal(rng: np.random.Generator) -> Metal:
    """Draw an aluminium alloy, or one half as strong again, and how even it is."""
    strong = float(rng.choice([1.0, 1.55]))
    return Metal(
        shear=np.array([840.0, 320.0, 180.0]) * np.exp(0.15 * rng.standard_normal(3)) * strong * N_MM2,
        edge=np.array([14.0, 19.0, 4.5]) * np.exp(0.2 * rng.standard_normal(3)) * N_MM,
        bottom=(float(rng.uniform(70.0, 120.0)) * N_MM2, float(rng.uniform(3.0, 5.5)) * N_MM),
        bottom_drag=float(rng.uniform(0.2, 0.6)),
        length=drawn_size(rng, 0.2, 1.5) * UM,
        contact=drawn_size(rng, 0.2, 1.0) * UM,
        plough=float(rng.uniform(0.05, 0.25)),
        least_chip=drawn_size(rng, 1.0, 4.0) * UM,
        common=drawn_size(rng, 0.003, 0.01),
        own=drawn_size(rng, 0.003, 0.01),
        drift=drawn_signed(rng, 0.005, 0.03),
        bar=drawn_signed(rng, 0.004, 0.025) if rng.uniform() < 0.3 else 0.0,
        bar_from=float(rng.uniform(0.35, 0.75)),
    )


def factors(metal: Metal, share: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Factors in one run on shear (3,), edge (3,), bottom (2,), after a ``share`` of the session."""
    session = (1.0 + metal.drift * share) * (1.0 + metal.bar * float(share >= metal.bar_from))
    common = session * (1.0 + metal.common * float(rng.standard_normal()))
    own = 1.0 + metal.own * rng.standard_normal(8)
    return common * own[:3], common * own[3:6], common * own[6:]


def size_exponent(metal: Metal, feed: float) -> tuple[float, float]:
    """Return the exponent m of K ∝ h^−m that is closest over slots of ``feed`` (m), and how sure that is.

    Fitted with a free edge force along a tooth's path; the second value is how far the exponent moves when
    the edge force is held. Which of the two a reader means, nobody can tell from a force.
    """
    h = feed * np.sin((np.arange(64) + 0.5) * math.pi / 64)
    true = metal.cutting(h)

    def misfit(m: float, *, edge: bool) -> float:
        columns = [h * (h / metal.reference) ** -m, *([np.ones_like(h)] if edge else [])]
        design = np.stack(columns, axis=1)
        rest = true - design @ np.linalg.lstsq(design, true, rcond=None)[0]
        return float(rest @ rest)

    tried = np.linspace(0.0, 0.5, 251)
    free, held = (float(tried[np.argmin([misfit(m, edge=edge) for m in tried])]) for edge in (True, False))
    return held, abs(free - held)


def length_for(exponent: float, metal: Metal) -> float:
    """Length of the strain gradient (m) at which the local exponent at the reference chip is ``exponent``."""
    return 2.0 * exponent / (1.0 - 2.0 * exponent) * metal.reference
