"""A machine that chatters and the tests made on it, drawn: what differs between boundary batches."""

from __future__ import annotations

import math

import numpy as np

from virtual_cell.flexible import Machine, Programme
from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.units import DEG, MM

STYLES = ("a", "b")
_PER_TURN, _CELL_DEG = 180, 2.0  # steps of the march: cuts begin and end between two of them
_METALS = ((800.0, 320.0, 100.0), (1150.0, 520.0, 200.0), (1900.0, 850.0, 300.0))  # N/mm²
_DECLARED_ERROR = 0.03  # error of the declared coefficients, standard deviation of the logarithm


def drawn_machine(rng: np.random.Generator) -> Machine:
    """Draw a machine that hides nothing: one to three modes in each direction, a tool, a metal, a cut."""
    first, soft = _between(rng, 150.0, 450.0), _between(rng, 5e6, 25e6)
    modes = (_modes(rng, first, soft), _modes(rng, first, soft))
    metal = np.array(_METALS[rng.integers(len(_METALS))]) * np.exp(rng.normal(0.0, 0.12, 3))
    diameter = float(rng.choice([8.0, 10.0, 12.0, 16.0, 20.0]))
    direction = str(rng.choice(["down", "up", "slot"], p=[0.4, 0.35, 0.25]))
    swept = 180.0 if direction == "slot" else _CELL_DEG * rng.integers(22, 61)
    return Machine(
        modes,
        in_millimetres(metal.tolist(), (0.0, 0.0, 0.0)),
        diameter * MM,
        int(rng.choice([2, 3, 4])),
        round(float(rng.uniform(0.04, 0.1)), 3) * MM,
        0.5 * diameter * MM * (1.0 - math.cos(swept * DEG)),
        direction,
    )


def _modes(rng: np.random.Generator, first: float, soft: float) -> Modes:
    """Draw the modes of a direction, the first about ``first`` (Hz) and of about ``soft`` (N/m)."""
    count = int(rng.choice([1, 2, 3], p=[0.45, 0.35, 0.2]))
    frequency = first * rng.uniform(0.85, 1.2) * np.cumprod([1.0, *rng.uniform(1.18, 1.5, count - 1)])
    stiffness = soft * rng.uniform(0.8, 1.6) * np.array([1.0, *rng.uniform(0.8, 3.0, count - 1)])
    return Modes(frequency, np.exp(rng.uniform(math.log(0.015), math.log(0.05), count)), stiffness)


def drawn_programme(rng: np.random.Generator, machine: Machine, style: str, seed: int) -> Programme:
    """Draw the tests.

    In style ``a``, nine evenly spaced speeds with two tests on either side of the boundary, and labels alone;
    in ``b`` number and spacing of the speeds, tests at each, what is held out, steps of depth and noise of
    the hammer differ, and three batches in ten have the records of the force.
    """
    every = machine.frequencies
    lowest = 60.0 * every.max() / rng.uniform(8.0, 12.0)  # more waves per turn are more than the march can
    ends = (lowest, lowest * rng.uniform(1.6, 2.6))
    varied = style == "b"
    count = int(rng.choice([5, 7, 9, 12], p=[0.15, 0.25, 0.3, 0.3])) if varied else 9
    apart = np.cumsum(rng.uniform(0.6, 1.4, count)) if varied else np.arange(count, dtype=float)
    speeds = np.interp(apart, [apart[0], apart[-1]], ends)
    rpm = tuple(float(10.0 * round(speed / 10.0)) for speed in speeds)
    held = 1 + rng.permutation(count - 2)[: round(count / 3)] if varied else np.arange(1, count, 3)
    ratio = float(rng.uniform(1.15, 1.3)) if varied else 1.25
    shallow = machine.level * float(rng.uniform(0.5, 0.8))
    depths = shallow * ratio ** np.arange(math.ceil(math.log(14.0) / math.log(ratio)))
    error = np.exp(_DECLARED_ERROR * rng.standard_normal(2))
    return Programme(
        rpm,
        tuple(rpm[i] for i in sorted(held)),
        tuple(round(float(a) / MM, 3) * MM for a in depths),
        beside=int(rng.choice([1, 2, 3], p=[0.3, 0.45, 0.25])) if varied else 2,
        declared=(machine.law.ktc * float(error[0]), machine.law.krc * float(error[1])),
        records=bool(varied and rng.uniform() < 0.3),
        per_turn=_PER_TURN,
        seed=seed,
        hammer_noise=_between(rng, 0.002, 0.015) if varied else 0.005,
        band=(float(round(0.25 * every.min())), float(round(2.0 * every.max()))),
    )


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))
