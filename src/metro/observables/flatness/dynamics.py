"""The dynamics of the arm's tip at a pose, from a batch's tables: mass, compliance, damping over the face."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from metro.observables.quantity import quantity
from metro.surface.tip_damping import Rayleigh, fit_rayleigh
from metro.surface.tip_field import MatrixField, choose_field, field_in, least_eigenvalue
from metro.surface.tip_response import tip_modes
from metro.surface.tip_stiffness import Basis, points_compliance
from metro.units import JSON, MM, Array

MASS = ("mxx", "mxy", "mxz", "mxy", "myy", "myz", "mxz", "myz", "mzz")
OF_THE_ARM = 2.0  # modes up to this factor times the highest of M and K belong to the arm
SURE = 3.0  # standard errors
ONE_MODE = 0.01  # relative difference of frequencies, at least, that makes two modes of blows along two axes


@dataclass(frozen=True)
class ArmMode:
    """A mode of the arm that M and K of the tip do not have, as impacts show it.

    Attributes
    ----------
    frequency : undamped, rad/s; infinite where no blow shows any mode: what follows the force at once.
    ratio : damping ratio.
    reach : by axis x, y, z the root of its static compliance, (m/N)^½, without its sign, which blows along
        one axis at a time do not show; 0 where they do not show the mode.
    """

    frequency: float
    ratio: float
    reach: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class TipDynamics:
    """M(P), C(P) = K(P)⁻¹ and the damping of the tip; ``damping`` is None if no impacts show any.

    ``beside``: the modes that impacts show along z and that M and K do not have; without impacts, what may
    follow the force at once.
    """

    mass: MatrixField
    compliance: MatrixField
    damping: Rayleigh | None
    beside: tuple[ArmMode, ...] = ()


def tip_dynamics(
    pose: str, basis: Basis, loads: tuple[Array, Array, Array], mass: pd.DataFrame, modes: pd.DataFrame
) -> tuple[TipDynamics | None, list[str]]:
    """Return the dynamics of the tip at a pose, None if the tables do not give it, and notes on it.

    Parameters
    ----------
    basis : terms in which the compliance varies. loads : positions, forces, displacements, (m, 3) each, SI.
    mass : rows of mass.csv of the pose. modes : the modes that the batch's impacts showed, all positions.
    """
    if mass.empty:
        return None, []
    places, at_points = points_compliance(*loads)
    matrices = np.array([np.nan_to_num(each.matrix) for each in at_points])
    if not all(np.isfinite(np.diagonal(each.matrix)).all() for each in at_points):
        words = f"Pose {pose}: a load point lacks a direction, so that no stiffness matrix can be made of it"
        return None, [f"{words}; the tip is taken to follow the force without ringing."]
    masses = mass[[*MASS]].to_numpy(dtype=float).reshape(-1, 3, 3)
    wrong = [
        *_indefinite("mass.csv", "mass", pose, mass["point"].astype(str), masses),
        *_indefinite("loads.csv", "compliance", pose, _names(places), matrices),
    ]
    if wrong:
        return None, [*wrong, f"Pose {pose}: without ringing, therefore."]
    x, y = mass["x_mm"].to_numpy(dtype=float) * MM, mass["y_mm"].to_numpy(dtype=float) * MM
    own = choose_field(x, y, masses)
    compliance = field_in(basis, places[:, 0], places[:, 1], matrices)
    spread = [
        np.linalg.norm(np.nan_to_num(each.sd)) / np.linalg.norm(np.nan_to_num(each.matrix))
        for each in at_points
    ]
    error = math.hypot(float(np.nanmean(spread)), *(np.nan_to_num([own.error, compliance.error])))
    notes = _interpolated(pose, own, len(mass))
    if least_eigenvalue(compliance(x, y)).min() <= 0:
        return None, [
            *notes,
            f"Pose {pose}: between its load points the compliance is not positive definite.",
        ]
    frequency = tip_modes(own(*places.T), np.linalg.inv(matrices)).frequency
    of_arm = _of_the_arm(pose, modes, frequency)
    others = _others(of_arm, frequency, 0.5 * error)
    notes += _said_of_others(pose, frequency, of_arm, others)
    if others[:1].any():  # then M or K is in doubt, and the measured modes may be theirs
        others = np.zeros_like(others)
    damping, said = _damping(pose, of_arm[~others])
    beside = (_at_once(matrices),) if of_arm.empty else _beside(of_arm[others])
    return TipDynamics(own, compliance, damping, beside), [*notes, *said]


def _at_once(matrices: Array) -> ArmMode:
    """Return a mode above all of M and K that takes the whole compliance along z, and a force across as much.

    Load tests hold all modes of an arm, M and K three. Where no blow shows the others it is not known how
    much of the compliance is theirs.
    """
    reach = math.sqrt(float(np.mean(matrices[:, 2, 2])))
    return ArmMode(math.inf, 0.0, (reach, reach, reach))


def _indefinite(
    file: str, what: str, pose: str, points: pd.Series | list[str], matrices: Array
) -> Iterator[str]:
    """Name every point whose matrix is not positive definite, which no structure can have."""
    for point, share in zip(points, least_eigenvalue(matrices), strict=True):
        if share <= 0:
            yield (
                f"{file}, pose {pose}, point {point}: the {what} matrix is not positive definite "
                f"(least eigenvalue {100 * share:.2g} % of the greatest)."
            )


def _names(places: Array) -> list[str]:
    return [f"at x {x / MM:g}, y {y / MM:g} mm" for x, y in places]


def _interpolated(pose: str, mass: MatrixField, points: int) -> list[str]:
    if points == 1:
        return []
    share = f"to {100 * mass.error:.1g} %" if math.isfinite(mass.error) else "to an unknown error"
    return [
        f"Pose {pose}: the mass over the face is a polynomial of {mass.basis.terms} terms through {points} "
        f"points; leaving out one at a time, it predicts the mass there {share}."
    ]


def _damping(pose: str, table: pd.DataFrame) -> tuple[Rayleigh | None, list[str]]:
    """Return the damping by those measured modes that M and K have, and notes on it.

    A mode that they do not have is another structure's, and says nothing of theirs.
    """
    if table.empty:
        return None, []
    measured = 2 * np.pi * table["frequency_hz"].to_numpy(dtype=float)
    rayleigh = fit_rayleigh(measured, *table[["damping", "damping_sd"]].to_numpy(dtype=float).T)
    a0, a1 = rayleigh.values
    error = np.sqrt(np.diag(rayleigh.covariance))
    misfit = f", missed by {rayleigh.misfit:.1f} times their errors" if rayleigh.misfit > 1 else ""
    return rayleigh, [
        f"Pose {pose}: damping from {len(table)} of the modes that impacts show{misfit}: "
        f"a0 {a0:.4g} ± {error[0]:.1g} 1/s, a1 {a1:.4g} ± {error[1]:.1g} s."
    ]


def _of_the_arm(pose: str, modes: pd.DataFrame, frequency: Array) -> pd.DataFrame:
    """Return the arm's modes that impacts at the pose (``pose`` or ``pose/point``) show, rising."""
    if modes.empty:
        return modes
    place = modes["position"].astype(str)
    known = np.isfinite(modes["damping_sd"].astype(float)) & (modes["damping_sd"].astype(float) > 0)
    of_arm = 2 * np.pi * modes["frequency_hz"].astype(float) <= OF_THE_ARM * frequency.max()
    here = (place == pose) | place.str.startswith(f"{pose}/")
    found: pd.DataFrame = modes[here & known & of_arm].sort_values("frequency_hz")
    return found


def _others(table: pd.DataFrame, frequency: Array, error: float) -> np.ndarray:
    """Mark the measured modes that differ from every mode of M and K by more than the errors of both.

    ``frequency`` (n, 3) rad/s: that of M and K at the load points, with the relative ``error``.
    """
    low, high = frequency.min(axis=0) / (2 * np.pi), frequency.max(axis=0) / (2 * np.pi)
    columns = (table[name].to_numpy(dtype=float) for name in ("frequency_hz", "frequency_sd_hz"))
    others = []
    for measured, sd in zip(*columns, strict=True) if len(table) else ():
        off = np.maximum(np.maximum(low - measured, measured - high), 0.0)
        others.append(bool(off.min() > SURE * math.hypot(np.nan_to_num(sd), error * measured)))
    return np.array(others, dtype=bool)


def _said_of_others(pose: str, frequency: Array, table: pd.DataFrame, others: np.ndarray) -> Iterator[str]:
    """Name the modes that M and K do not have.

    That there are some is no contradiction: M and K of the tip hold three modes, an arm has more. The lowest
    of them should be among the three.
    """
    if not others.any():
        return
    along = zip(table["frequency_hz"], table["direction"], others, strict=True)
    listed = ", ".join(f"{hz:.4g} Hz along {direction}" for hz, direction, other in along if other)
    low, high = frequency.min(axis=0) / (2 * np.pi), frequency.max(axis=0) / (2 * np.pi)
    three = ", ".join(f"{a:.4g} to {b:.4g} Hz" for a, b in zip(low, high, strict=True))
    why = (
        "The lowest of the arm's modes is among them: check mass.csv and loads.csv."
        if others[0]
        else "An arm has more modes than these three: those that blows along z show swing beside them."
    )
    yield f"Pose {pose}: M and K (mass.csv, loads.csv: {three} over the face) do not have {listed}. {why}"


def _beside(table: pd.DataFrame) -> tuple[ArmMode, ...]:
    """Return the modes of a table, rising; what blows along several axes show at one frequency is one."""
    if table.empty:
        return ()
    hz, sd = (table[name].to_numpy(dtype=float) for name in ("frequency_hz", "frequency_sd_hz"))
    apart = np.maximum(SURE * np.hypot(sd[1:], sd[:-1]), ONE_MODE * hz[1:])
    number = np.cumsum(np.append(0, np.diff(hz) > apart))
    modes = []
    for _, rows in table.groupby(number):
        softest = rows.groupby("direction")["stiffness_n_m"].min()
        stiffness = [float(softest.get(axis, math.nan)) for axis in "xyz"]
        reach = [1.0 / math.sqrt(each) if each > 0.0 else 0.0 for each in stiffness]
        if reach[2]:
            frequency = 2.0 * math.pi * float(rows["frequency_hz"].mean())
            modes.append(ArmMode(frequency, float(rows["damping"].mean()), (reach[0], reach[1], reach[2])))
    return tuple(modes)


def tip_block(damping: Mapping[str, Rayleigh]) -> JSON:
    """Return the block ``tip`` of identified.json from a0, a1 by pose: their weighted mean, and each."""
    if not damping:
        return {}
    weight = [np.linalg.inv(each.covariance) for each in damping.values()]
    covariance = np.linalg.inv(np.sum(weight, axis=0))
    mean = covariance @ np.sum([w @ d.values for w, d in zip(weight, damping.values(), strict=True)], axis=0)
    block = _coefficients(mean, covariance)
    if len(damping) > 1:
        block["poses"] = {pose: _coefficients(d.values, d.covariance) for pose, d in damping.items()}
    return {"tip": block}


def _coefficients(values: Array, covariance: Array) -> JSON:
    sd = np.sqrt(np.diag(covariance))
    return {"a0": quantity(values[0], sd[0], "1/s"), "a1": quantity(values[1], sd[1], "s")}
