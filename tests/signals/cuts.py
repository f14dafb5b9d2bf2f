"""Simulated test cuts on the published machine (position 1), and what its lobes say of them."""

from dataclasses import replace

import numpy as np

from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.signals.orders import spindle_speed
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.recipes.trimule import MODES, TITANIUM
from virtual_cell.regeneration import Trials, march

X, Z = MODES["x"], MODES["z"]
FEED, TEETH, RATE = 0.02e-3, 4, 4096.0
STRUCTURE = Structure(
    np.repeat([0, 1], 4),
    np.concatenate([X.omega, Z.omega]),
    np.concatenate([X.damping, Z.damping]),
    np.concatenate([X.stiffness, Z.stiffness]),
)
SLOT = Cut(TEETH, 0.0, np.pi, TITANIUM.ktc, TITANIUM.krc)
SENSOR = Dynamometer(RATE, "tool", np.eye(3), noise=2.0)
PER_TURN = 120
VISIBLE = 0.5  # of the feed per tooth: range over the turns that is chatter


def boundary(rpm):
    return stability_boundary(STRUCTURE, SLOT, np.asarray(rpm, float)).depth


def law(edges, wear=0.0):
    """Published coefficients with a share of the edge forces, which theory takes to drop out."""
    k = TITANIUM
    return replace(k, kte=edges * k.kte, kre=edges * k.kre, kae=edges * k.kae, wear=wear)


def trials(rpm, depth, *, edges=0.1, wear=0.0, **rest):
    return Trials((X, Z), law(edges, wear), TEETH, FEED, np.asarray(rpm, float), np.asarray(depth), **rest)


def spread(history, turns=30):
    """Largest range over the last ``turns`` of the tip at one angle of the spindle, in feeds per tooth."""
    tip = history.tip[:, -turns * PER_TURN :]
    return np.ptp(tip.reshape(len(tip), turns, PER_TURN, 2), axis=1).max(axis=(1, 2)) / FEED


def recorded(history, rpm, *, skip=0, sensor=SENSOR, seed=0, what="force"):
    """Time, angle (speed found in the record, nominal off by 0.3 %) and reading of each test."""
    rng = np.random.default_rng(seed)
    for i, n in enumerate(rpm):
        duration = (history.tip.shape[1] / PER_TURN - 2) * 60.0 / n
        time, read = record(sensor, lambda t, i=i: history.at(i, t, what), duration, rng)
        full = time > skip * 60.0 / n
        time, read = time[full], read[full]
        speed, _ = spindle_speed(time, read, 1.003 * n / 60.0, 24)
        yield time, 2.0 * np.pi * speed * time, read


def bracketed(rpm, depth, turns, **settings):
    """History of the tests, and whether they chatter: 1, 0, or −1 where 5 % of depth would change that."""
    spreads = []
    for factor in (0.95, 1.05, 1.0):
        history = march(trials(rpm, factor * np.asarray(depth), **settings), turns, PER_TURN, seed=1)
        spreads.append(spread(history))
    unstable = np.array(spreads) > VISIBLE
    return history, np.where(unstable.all(axis=0), 1, np.where(unstable.any(axis=0), -1, 0))
