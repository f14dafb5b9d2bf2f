"""Chatter tests of many machines, tools, metals and ways of measuring, with what really happened in each.

Every test has a machine of its own: two modes in each direction of the plane of cutting, a metal, a tool of
two to six teeth, an immersion, a speed, a runout, a roughness of the force; and an instrument of its own:
rate, noise, resonance, drift, with a tacho or without. Its depth is drawn about the boundary of its lobes.
What is true is the motion of the simulated tip, in which teeth leave the cut: it chatters where it does not
repeat from turn to turn by half the feed per tooth. Tests that 5 % of depth turns over lie on the boundary.
"""

from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.lobes import spectral_radius, stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.signals.orders import highest_order, spindle_speed
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.milling import Coefficients
from virtual_cell.modes import Modes
from virtual_cell.regeneration import Trials, march

TEETH = (2, 3, 4, 6)
PER_TURN = 120
FEED = 0.05e-3  # per tooth, of all: forces and motions scale with it
ENTRY, LEAST, MOST = 15, 42, 125  # turns of entry, and of the cut thereafter
LAST = 25  # turns in which the motion is looked at
VISIBLE = 0.5  # of the feed per tooth: range over the turns that is chatter
BESIDE = 0.05  # of the depth, to either side of the boundary
FASTEST = 24000.0
HIGHEST = 8.0  # order of the spindle, of the main mode
METALS = {"aluminium": (7e8, 0.3), "steel": (1.9e9, 0.4), "titanium": (1.7e9, 0.5), "published": (1e10, 1.09)}
PARTS, LAW = ("damped", "damping", "stiffness"), ("ktc", "krc", "kac", "kte", "kre", "kae")
FINE = 8  # parts of a bin to which the tip's own frequency is read


@dataclass(frozen=True)
class Setting:
    """One test: machine, tool, cut and instrument. SI; ``deep`` is the depth over that of the boundary."""

    teeth: int
    modes: tuple
    metal: str
    coefficients: Coefficients
    rpm: float
    immersion: tuple
    deep: float
    depth: float
    runout: float
    scatter: float
    turns: int
    rate: float
    noise: float
    resonance: float
    slope: tuple
    tacho: bool
    nominal: float


@dataclass(frozen=True, eq=False)
class Test:
    """A record, (n,), (n,), (n, 3), and what happened: ``unstable`` 1, 0, or −1 on the boundary.

    ``hz`` is the tip's own chatter frequency, NaN where it is stable; ``flips`` whether that is half the
    tooth passing, ``locked`` whether it repeats with the spindle all the same; ``linear`` the largest Floquet
    multiplier at 95, 100 and 105 % of the depth.
    """

    setting: Setting
    time: np.ndarray
    angle: np.ndarray
    signal: np.ndarray
    unstable: int
    hz: float
    flips: bool
    locked: bool
    linear: np.ndarray


def settings(count, teeth, seed, *, deep=(0.4, 2.5)):
    """Draw tests of tools with so many teeth."""
    rng = np.random.default_rng([seed, teeth])
    return [_setting(teeth, rng, deep) for _ in range(count)]


def _log(rng, low, high, size=None):
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def _setting(teeth, rng, deep):
    frequency = _log(rng, 20.0, 900.0)
    order = min(_log(rng, 0.3, 3.0) * teeth, HIGHEST)  # of the main mode, in turns of the spindle
    rpm = min(60.0 * frequency / order, FASTEST)
    stiffness = _log(rng, 1e6, 3e7)
    modes = []
    for part in (1.0, rng.uniform(0.7, 1.4)):
        f = frequency * part * np.array([1.0, rng.uniform(1.2, 1.5)])
        k = stiffness * _log(rng, 0.5, 2.0) * np.array([1.0, _log(rng, 1.5, 6.0)])
        modes.append(Modes(f, _log(rng, 0.01, 0.06, 2), k))
    metal = str(rng.choice(list(METALS)))
    kt, ratio = METALS[metal]
    edge = rng.uniform(0.0, 0.3)
    shear = kt * np.array([1.0, ratio, 0.3]) * _log(rng, 0.8, 1.25, 3)
    law = Coefficients(*shear, *(edge * FEED * shear))
    angle = np.arccos(1.0 - 2.0 * rng.choice([0.1, 0.25, 0.5, 1.0], p=[0.2, 0.2, 0.2, 0.4]))
    immersion = (0.0, angle) if rng.random() < 0.5 else (np.pi - angle, np.pi)
    factor = _log(rng, *deep)
    limit = stability_boundary(structure(modes), _cut(teeth, immersion, law), np.array([rpm])).depth[0]
    # not below what the march resolves: the filter against aliasing must see all that is in the force
    slowest = max(1000.0, 0.5 * PER_TURN * rpm / 60.0, rng.uniform(10.0, 40.0) * frequency)
    rate = float(2.0 ** np.ceil(np.log2(slowest)))
    return Setting(
        teeth,
        tuple(modes),
        metal,
        law,
        rpm,
        immersion,
        factor,
        factor * limit,
        FEED * rng.choice([0.0, rng.uniform(0.0, 0.3), rng.uniform(0.3, 1.0)], p=[0.1, 0.6, 0.3]),
        _log(rng, 0.005, 0.08),
        int(rng.integers(LEAST, MOST + 1)),
        rate,
        _log(rng, 0.003, 0.05),
        rng.choice([0.0, frequency * rng.uniform(1.5, 6.0)]),
        tuple(rng.normal(size=3) * 0.1),
        bool(rng.random() < 0.5),
        1.0 + rng.uniform(-0.005, 0.005),
    )


def structure(modes):
    """Give the modes as the lobes take them."""
    axis = np.repeat([0, 1], [len(m.damped) for m in modes])
    return Structure(
        axis, *(np.concatenate([getattr(m, n) for m in modes]) for n in ("omega", "damping", "stiffness"))
    )


def _cut(teeth, immersion, law):
    return Cut(teeth, *immersion, law.ktc, law.krc)


def trials(drawn, seed):
    """March settings of one number of teeth together; yield a test for each that has a boundary."""
    drawn = [s for s in drawn if np.isfinite(s.depth)]
    factors = np.repeat([1.0, 1.0 - BESIDE, 1.0 + BESIDE], len(drawn))
    history = march(_trials(drawn * 3, factors), ENTRY + MOST + 2, PER_TURN, seed)
    ranges = np.array([_spread(tip, one) for tip, one in zip(history.tip, drawn * 3, strict=True)])
    over = ranges.reshape(3, -1).T > VISIBLE
    labels = np.where(over.all(axis=1), 1, np.where(over.any(axis=1), -1, 0))
    linear = np.array([_multipliers(one) for one in drawn])
    locked = _locked(drawn, (labels == 0) & (linear > 1.0).all(axis=1))
    for i, one in enumerate(drawn):
        hz, flips = _own(history.tip[i], one) if labels[i] == 1 else (np.nan, bool(locked[i]))
        label = 1 if locked[i] else int(labels[i])
        yield Test(one, *recorded(history, i, one, seed), label, hz, flips, bool(locked[i]), linear[i])


def _multipliers(one):
    """Largest Floquet multiplier (3,) at 95, 100 and 105 % of the depth."""
    depths = one.depth * np.array([1.0 - BESIDE, 1.0, 1.0 + BESIDE])
    cut = _cut(one.teeth, one.immersion, one.coefficients)
    return spectral_radius(structure(one.modes), cut, np.full(3, one.rpm), depths)


def _locked(drawn, may):
    """Which tests (n,) of those that may do flip in step with the spindle, as even numbers of teeth can.

    Such a cut repeats from turn to turn, but not from tooth to tooth even where nothing runs out.
    """
    found = np.zeros(len(drawn), dtype=bool)
    places = np.flatnonzero(may & (drawn[0].teeth % 2 == 0))
    if len(places):
        clean = [replace(drawn[i], runout=0.0, scatter=0.0) for i in places]
        history = march(_trials(clean, np.ones(len(clean))), ENTRY + MOST + 2, PER_TURN)
        for i, tip, one in zip(places, history.tip, clean, strict=True):
            last = _last(tip, one, LAST)
            apart = np.ptp([last, np.roll(last, PER_TURN // one.teeth, axis=0)], axis=0)[PER_TURN:].max()
            found[i] = apart > VISIBLE * FEED and _spread(tip, one) <= VISIBLE
    return found


def _trials(drawn, factors):
    """All tests in one march: what belongs to a test is (n, 1) where teeth are side by side."""
    modes = tuple(
        Modes(*(_each(drawn, lambda s, a=axis, p=part: getattr(s.modes[a], p)) for part in PARTS))
        for axis in (0, 1)
    )
    law = Coefficients(*(_each(drawn, lambda s, p=part: [getattr(s.coefficients, p)]) for part in LAW))
    return Trials(
        modes,
        law,
        drawn[0].teeth,
        FEED,
        _each(drawn, lambda s: s.rpm),
        factors * _each(drawn, lambda s: s.depth),
        _each(drawn, lambda s: [s.runout]),
        0.3,
        scatter=_each(drawn, lambda s: s.scatter),
        entry=ENTRY,
        immersion=tuple(_each(drawn, lambda s, k=k: [s.immersion[k]]) for k in (0, 1)),
    )


def _each(drawn, what):
    return np.array([what(one) for one in drawn])


def _last(tip, one, turns):
    end = (ENTRY + one.turns) * PER_TURN
    return tip[end - turns * PER_TURN : end]


def _spread(tip, one):
    """Largest range, over the last turns, of the tip at one angle of the spindle, in feeds per tooth."""
    last = _last(tip, one, LAST).reshape(LAST, PER_TURN, 2)
    return np.ptp(last, axis=0).max() / FEED


def _own(tip, one):
    """Strongest frequency of the tip off the orders of the spindle, and whether it is a flip."""
    turns = one.turns - 5
    last = _last(tip, one, turns)
    last = last - last.mean(axis=0)
    spectrum = np.abs(np.fft.rfft(last * np.hanning(len(last))[:, None], FINE * len(last), axis=0)).sum(
        axis=1
    )
    order = np.arange(len(spectrum)) / (FINE * turns)
    spectrum[(np.abs(order - np.round(order)) < 2.5 / turns) | (order < 2.5 / turns)] = 0.0
    found = order[spectrum.argmax()]
    half = abs(abs(found / one.teeth % 1.0) - 0.5) * one.teeth
    return found * one.rpm / 60.0, bool(half < 1.5 / turns)


def recorded(history, i, one, seed):
    """Time, angle and reading of a test's record, from full depth on; the speed is found in it or told."""
    rng = np.random.default_rng([seed, i])
    start, seconds = ENTRY * 60.0 / one.rpm, one.turns * 60.0 / one.rpm
    size = float(history.force[i, ENTRY * PER_TURN :].std())
    mode = (one.resonance, 0.02) if one.resonance else None
    sensor = Dynamometer(
        one.rate,
        "tool",
        np.eye(3),
        one.noise * size,
        resonance=(mode,) * 3,
        slope=tuple(size * s / seconds for s in one.slope),
        capacity=np.inf,
        step=1e-4 * size,
    )
    time, read = record(sensor, lambda t: history.at(i, t + start), seconds, rng)
    speed = one.rpm / 60.0
    if not one.tacho:
        speed, _ = spindle_speed(time, read, one.nominal * speed, highest_order(one.rate, speed, one.teeth))
    return time, 2.0 * np.pi * speed * time, read
