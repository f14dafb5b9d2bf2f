"""Cuts to use: the stable pockets of a boundary, with what they remove, their torque, power and chatter.

A pocket is a speed at which more material can be removed, surely stable, than at the speeds about it. Its
depth is the lower end of the boundary's 95 % band, at the worst of the speed itself and its neighbours on the
diagram: a spindle does not turn exactly as programmed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from metro.cutting.cutter import Cutter
from metro.cutting.declared import cutter_of
from metro.cutting.engagement import Engagement, engagement
from metro.units import JSON, MM, N_MM, N_MM2, RPM, Array

MOST = 3  # pockets of a position
DEEPER = 2.0  # than the deepest cut made: beyond, other modes, forces and the work itself are not known
PROBABILITY = 0.975  # of a stable cut, at the lower end of the band
CONTRADICTED = 0.05  # chance of as many chattering tests below the band: under it the band is not believed
# Columns of the run table that say which boundary a cut has.
CUT = ("operation", "direction", "radial_depth_mm", "feed_direction_deg")
# Stable tests below the band that confirm it by themselves: of a band at half of which cuts chatter, so many
# would be stable with a probability of 3 %.
CONFIRMING = 5
SURE = ("clean", "explained", "partly_explained")


@dataclass(frozen=True)
class Lateral:
    """What bends a tool at its holder, SI.

    Attributes
    ----------
    cutter : without runout. overhang : from the holder to the tip, m.
    coefficients : K_tc, K_rc, K_te and K_re.
    """

    cutter: Cutter
    overhang: float
    coefficients: tuple[float, float, float, float]

    def moment(self, arc: Engagement, feed: float, depth: float) -> float:
        """Largest moment at the holder over a revolution, N m: lateral force times the way to mid-depth.

        Of a rigid tool on a straight path; the axial force, which is near the axis, is left out.
        """
        # The force needs numba, which a verdict without lobes does without.
        from metro.cutting.chip import Cut
        from metro.cutting.force import force_basis
        from metro.cutting.law import EdgeLaw

        basis = force_basis(self.cutter, EdgeLaw(), Cut(feed, depth, arc))[:, :2]
        force = basis[..., [0, 1, 3, 4]] @ np.array(self.coefficients)
        return float(np.hypot(*force.T).max()) * (self.overhang - 0.5 * depth)


@dataclass(frozen=True)
class Milling:
    """Tool and coefficients of a batch, SI; ``hole_radius`` of helical cuts.

    ``lateral``: what bends the tool, where that is known. ``sure``: whether the interval of K_tc is above
    zero; else no depth follows from it.
    """

    radius: float
    teeth: int
    ktc: float
    kte: float
    hole_radius: float = 0.0
    lateral: Lateral | None = None
    sure: bool = True

    @classmethod
    def of(cls, manifest: JSON, identified: JSON) -> Milling | None:
        """Return tool and coefficients, declared or identified; None where they are not known."""
        tool = manifest.get("tool") or {}
        declared = manifest.get("coefficients") or {}
        waveform = (identified.get("force") or {}).get("waveform") or {}
        ktc, krc, kte, kre = (
            declared.get(f"{name}_{unit}", (waveform.get(name) or {}).get("value"))
            for name, unit in (("ktc", "n_mm2"), ("krc", "n_mm2"), ("kte", "n_mm"), ("kre", "n_mm"))
        )
        if ktc is None or kte is None or not {"diameter_mm", "teeth"} <= set(tool):
            return None
        edge = math.cos(math.radians(tool.get("helix_deg", 0.0))) if _per_arc(declared) else 1.0
        hole = 0.5 * float(manifest.get("hole_diameter_mm") or 0.0) * MM
        radius, teeth = 0.5 * tool["diameter_mm"] * MM, int(tool["teeth"])
        shear, sharp = ktc * N_MM2, kte / edge * N_MM
        lateral = None
        if krc is not None and kre is not None and "overhang_mm" in tool:
            coefficients = (shear, krc * N_MM2, sharp, kre / edge * N_MM)
            lateral = Lateral(cutter_of(tool), tool["overhang_mm"] * MM, coefficients)
        low = ((waveform.get("ktc") or {}).get("ci95") or [None])[0]
        sure = "ktc_n_mm2" in declared or low is None or low > 0.0
        return cls(radius, teeth, shear, sharp, hole, lateral, sure)

    def width(self, operation: str, radial_depth: float) -> float:
        """Width of the chip's section, m: volume over depth and feed. A hole is removed as a whole."""
        if operation == "helical":
            return self.hole_radius**2 / (2.0 * (self.hole_radius - self.radius))
        return 2.0 * self.radius if operation == "slot" else radial_depth

    def torque(self, operation: str, direction: str, radial_depth: float, feed: float) -> float:
        """Mean torque per axial depth, N m/m: N R/(2π) × (K_tc c (cos φ_s − cos φ_e) + K_te (φ_e − φ_s)).

        Altintas, Manufacturing Automation, 2nd ed., chapter 2. ``feed`` per tooth, m.
        """
        arc = engagement(operation, direction, radial_depth, self.radius)
        chip = feed * (math.cos(arc.entry) - math.cos(arc.exit))
        length = arc.exit - arc.entry
        return self.teeth * self.radius / (2.0 * math.pi) * (self.ktc * chip + self.kte * length)

    def bending(
        self, operation: str, direction: str, radial_depth: float, feed: float, depth: float
    ) -> float | None:
        """Largest bending moment at the holder, N m; None where overhang or coefficients are not known."""
        if self.lateral is None:
            return None
        arc = engagement(operation, direction, radial_depth, self.radius)
        return self.lateral.moment(arc, feed, depth)


def _per_arc(declared: JSON) -> bool:
    return "kte_n_mm" in declared and declared.get("edge_length", "axial") != "axial"


@dataclass(frozen=True)
class Reach:
    """How far the evidence of a batch reaches, beyond which no cut is recommended.

    Attributes
    ----------
    limits : of ``batch.yaml``: least and greatest, by column of ``runs.csv``.
    deepest_mm : of the cuts made, times :data:`DEEPER`, and of the work; NaN where neither is known.
    highest_hz : highest frequency that a hammer excited, by position; none where modes are declared.
    struck : directions of the hits, such as ``xy``, by position; none where modes are declared.
    """

    limits: Mapping[str, Any]
    deepest_mm: float = math.nan
    highest_hz: Mapping[str, float] = field(default_factory=dict)
    struck: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, manifest: JSON, runs: pd.DataFrame, frf: pd.DataFrame) -> Reach:
        """Return the reach of a batch. ``frf``: table ``frf_used``."""
        made = pd.to_numeric(runs["axial_depth_mm"], errors="coerce").max()
        size = (manifest.get("work") or {}).get("size_mm") or [math.nan] * 3
        bounds = [one for one in (DEEPER * float(made), float(size[2])) if math.isfinite(one)]
        highest, struck = {}, {}
        for position, rows in frf.groupby("position"):
            highest[str(position)] = float(rows["frequency_hz"].max())
            along = rows["reference"].str[-1]  # a response across the hit makes no mode of its direction
            struck[str(position)] = "".join(sorted(set(along[along == rows["response"].str[-1]])))
        return cls(manifest.get("limits") or {}, min(bounds, default=math.nan), highest, struck)


def recommended_cuts(
    lobes: pd.DataFrame, tests: pd.DataFrame, status: str | None, milling: Milling, reach: Reach
) -> list[JSON]:
    """Return the cuts to use at each position, the largest removal rate first, or why there are none.

    Parameters
    ----------
    lobes : table ``lobes_final``. tests : table ``lobe_runs`` with the columns :data:`CUT` of the run table.
    status : of the verdict on stability; None: no cut was tested.
    reach : of the evidence. No cut is deeper, and none has its teeth pass at a frequency that no hammer
        reached: which modes would chatter there is not known.

    Returns
    -------
    list of JSON
        ``position``, ``spindle_rpm``, ``axial_depth_mm``, whether that is the reach of the evidence
        (``at_reach``), the other settings, ``probability_stable`` (at least), ``removal_cm3_min``,
        ``torque_nm``, ``power_kw``, ``bending_nm`` (None without overhang), ``chatter_hz`` (at the
        boundary there), ``advice``: ``use``, ``try`` (begin at half the depth and listen: no test confirms
        it) or ``do_not``; ``why`` as a code.
    """
    found = []
    for position, rows in lobes.groupby("position", sort=False):
        line = rows.sort_values("rpm").reset_index(drop=True)
        if "operation" not in line or not line["feed_per_tooth_mm"].gt(0.0).all():
            continue
        known = _tested(line, tests[tests["position"] == position])
        below, chattered = _below(line, known)
        highest = reach.highest_hz.get(str(position), math.inf)
        pockets = sorted(_pockets(line, milling, reach, highest), key=lambda cut: -cut["removal_cm3_min"])
        lacking = _lacking(milling, reach.struck.get(str(position)))
        for cut in pockets[:MOST]:
            near = known["rpm"].min() <= cut["spindle_rpm"] <= known["rpm"].max()
            advice, why = lacking or _advice(status, below, chattered, within=bool(near))
            found.append({"position": position, **cut, "advice": advice, "why": why})
    return found


def _pockets(line: pd.DataFrame, milling: Milling, reach: Reach, highest_hz: float) -> Iterator[JSON]:
    """Yield the surely stable cut of each speed at which removal has a local maximum."""
    rpm, low = line["rpm"].to_numpy(float), line["depth_lo_mm"].to_numpy(float)
    least, most = reach.limits.get("spindle_rpm") or (-math.inf, math.inf)
    most = min(most, 60.0 * highest_hz / milling.teeth)
    known = math.inf if math.isnan(reach.deepest_mm) else reach.deepest_mm
    shallow, deepest = reach.limits.get("axial_depth_mm") or (0.0, known)
    depth = np.minimum(_worst_about(low), deepest)
    removal = np.where((rpm >= least) & (rpm <= most) & (depth >= shallow), rpm * depth, -math.inf)
    higher = np.concatenate([[-math.inf], removal, [-math.inf]])
    peaks = np.flatnonzero((removal > higher[:-2]) & (removal >= higher[2:]) & np.isfinite(removal))
    for at in peaks:
        row = line.iloc[int(at)]
        cut = _cut(row, float(depth[at]), milling)
        yield {**cut, "at_reach": bool(depth[at] == known and "axial_depth_mm" not in reach.limits)}


def _worst_about(values: Array) -> Array:
    """Least of each value and its two neighbours."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.asarray(np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:]))


def _cut(row: pd.Series, depth_mm: float, milling: Milling) -> JSON:
    """Return a cut with what it removes and takes."""
    operation, direction = str(row["operation"]), str(row["direction"]) or "slot"
    radial = float(row["radial_depth_mm"])
    radial_m = 2.0 * milling.radius if math.isnan(radial) else radial * MM
    feed, depth, speed = float(row["feed_per_tooth_mm"]) * MM, depth_mm * MM, float(row["rpm"]) * RPM
    torque = depth * milling.torque(operation, direction, radial_m, feed)
    feed_rate = feed * milling.teeth * speed / (2.0 * math.pi)
    removal = milling.width(operation, radial_m) * depth * feed_rate
    return {
        "spindle_rpm": float(row["rpm"]),
        "axial_depth_mm": depth_mm,
        "operation": operation,
        "direction": direction,
        "radial_depth_mm": None if math.isnan(radial) else radial,
        "feed_per_tooth_mm": float(row["feed_per_tooth_mm"]),
        "probability_stable": PROBABILITY,
        "removal_cm3_min": 60.0 * removal * 1e6,
        "torque_nm": torque,
        "power_kw": torque * speed / 1e3,
        "bending_nm": milling.bending(operation, direction, radial_m, feed, depth),
        "chatter_hz": float(row["chatter_hz"]),
    }


def _tested(line: pd.DataFrame, tests: pd.DataFrame) -> pd.DataFrame:
    """Return the tests of the cut of a boundary of which it is known whether they chattered."""
    cut = line.iloc[0]
    same = tests["operation"].eq(cut["operation"]) & tests["direction"].eq(cut["direction"])
    for name in CUT[2:]:
        both = tests[name].isna() & pd.isna(cut[name])
        same &= both | np.isclose(tests[name].to_numpy(float), cut[name])
    return tests[same & (tests["unstable"] >= 0) & tests["own_modes"].astype(bool)]


def _below(line: pd.DataFrame, known: pd.DataFrame) -> tuple[int, int]:
    """Count the tests below the band of a boundary, and those of them that chattered."""
    low = np.interp(known["rpm"].to_numpy(float), line["rpm"], line["depth_lo_mm"])
    below = known["depth_mm"].to_numpy(float) <= low
    return int(below.sum()), int((below & (known["unstable"].to_numpy() > 0)).sum())


def _lacking(milling: Milling, struck: str | None) -> tuple[str, str] | None:
    """Return advice against any cut where what the boundary is made of is not known, and why, as codes.

    A tool bends in two directions. One that was struck in a single one is taken as rigid in the other, which
    makes the boundary too high by any factor.
    """
    if struck is not None and len(struck) < 2:
        return "do_not", "struck_in_one_direction"
    return None if milling.sure else ("do_not", "force_not_known")


def _advice(status: str | None, below: int, chattered: int, *, within: bool) -> tuple[str, str]:
    """Return what to do with a pocket, and why, as codes.

    Parameters
    ----------
    below, chattered : tests below the band, and those of them that chattered. within : whether the speed is
        among those of the tests.
    """
    if _chance(below, chattered) < CONTRADICTED:
        return "do_not", "tests_chatter_below_the_band"
    if status in ("unexplained", "undetermined", "contradicted"):
        return "do_not", f"verdict_{status}"
    if not below:
        return "try", "no_test_below_the_band"
    if not within:
        return "try", "no_test_at_such_a_speed"
    if status in SURE or below - chattered >= CONFIRMING:
        return "use", "tests_confirm_the_band"
    return "try", "too_few_tests"


def _chance(tests: int, chattered: int) -> float:
    """Probability of so many or more chattering tests, where each does so with what the band leaves."""
    share = 1.0 - PROBABILITY
    fewer = (math.comb(tests, k) * share**k * (1.0 - share) ** (tests - k) for k in range(chattered))
    return 1.0 - sum(fewer)
