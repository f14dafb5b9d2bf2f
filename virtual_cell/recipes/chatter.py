"""trimule-chatter: holes milled ever deeper until they chatter, with their records and stylus traces.

Tool, hole, coefficients and plan of the tests are the published ones: four speeds, and at each a depth per
orbit of 0.05 mm that is raised in steps of 0.05 mm until there is chatter. The published modes would chatter
before the first step at most of these speeds; the machine here has the same frequencies and damping, and
``_STIFFER`` times their stiffness. The labels are those of an operator who mishears one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import resample_poly

from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.milling import Coefficients
from virtual_cell.recipes.trimule import HOLE_MM, MODES, TITANIUM, impacts
from virtual_cell.regeneration import History, Trials, march
from virtual_cell.session import write_force
from virtual_cell.units import MM, UM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

RATE, _FINER, _NOISE = 1024.0, 8, 1.0
_FEED_MM, _TEETH, _RADIUS_MM = 0.02, 4, 6.0
_ORBIT_MM = HOLE_MM / 2.0 - _RADIUS_MM  # radius of the path of the tool's centre
_RPM = (1000.0, 1500.0, 2000.0, 2500.0)
_STEP_MM, _DEEPEST = 0.05, 12
_STIFFER = 3.9  # so that no boundary is within 4 % of a step
_RUNOUT_UM, _RUNOUT = 2.0, 0.3
_TURNS, _ENTRY, _PER_TURN = 160, 15, 276
_RECORDED = 90  # turns, the last ones: chatter that begins has grown by then
# Of the feed, rad, in each revolution of the spindle: 0.3 % more than the feed per tooth makes of it. It is
# one step of the march: teeth enter and leave at a step in every turn, and none of this is a vibration.
_TURN = 2.0 * math.pi / _PER_TURN
_WINDOWS, _WINDOW = 5, 20  # turns of a window: the difference between two cuts grows from one to the next
_FORGOTTEN = 1e-3  # of the force: a difference that has died out
_DEGREE = 4
_MISHEARD = 3  # test with a wrong label
_PROFILER = (0.01, 0.02)  # spacing, noise, mm and µm
_TRACE_MM = 8.0
# The theory of the lobes takes the edge forces to drop out. They do not quite: a vibration moves where a
# tooth enters and leaves the cut. These are a hundredth of the published ones.
_LAW = Coefficients(
    TITANIUM.ktc,
    TITANIUM.krc,
    TITANIUM.kac,
    0.01 * TITANIUM.kte,
    0.01 * TITANIUM.kre,
    0.01 * TITANIUM.kae,
)
_MODES = {name: replace(modes, stiffness=_STIFFER * modes.stiffness) for name, modes in MODES.items()}


@dataclass(frozen=True)
class Tested:
    """What really happened.

    Attributes
    ----------
    trials, history : the tests, and the course of each.
    unstable : (n,) which of them chattered. chatter_hz : (n,) strongest line of the force that is on no
        order of the spindle, Hz.
    """

    trials: Trials
    history: History
    unstable: np.ndarray
    chatter_hz: Array

    @property
    def rows(self) -> list[int]:
        """The tests that are made: at each speed deeper and deeper, up to the first that chatters."""
        made = []
        for rpm in _RPM:
            here = np.flatnonzero(self.trials.rpm == rpm)
            made += here[: 1 + int(np.argmax(self.unstable[here]))].tolist()
        return made


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(1954)
    tested = tests()
    fresh_folder(folder)
    rows = [_row(folder, tested, test, place, rng) for place, test in enumerate(tested.rows)]
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "impacts.csv", impacts(folder, rng, _MODES, hits=3))
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {
        "batch": folder.name,
        "unstable": [bool(tested.unstable[test]) for test in tested.rows],
        "chatter_hz": [float(tested.chatter_hz[t]) if tested.unstable[t] else None for t in tested.rows],
        "misheard": _MISHEARD,
    }


def tests() -> Tested:
    """March all tests in time, and see which of them chatter."""
    depths = _STEP_MM * np.arange(1, _DEEPEST + 1)
    rpm, depth = (a.ravel() for a in np.meshgrid(_RPM, depths * MM, indexing="ij"))
    trials = Trials(
        *((_MODES["x"], _MODES["z"]), _LAW, _TEETH, _FEED_MM * MM, rpm, depth, _RUNOUT_UM * UM, _RUNOUT),
        orbit=_TURN,
        immersion=(-1.0, 7.0),  # the feed turns: a tooth meets the work wherever it moves ahead
        scatter=0.006,
        entry=_ENTRY,
    )
    history = march(trials, _TURNS, _PER_TURN)
    return Tested(trials, history, _grows(trials), _between_orders(history))


def _grows(trials: Trials) -> np.ndarray:
    """Whether two cuts that enter a little differently move apart (n,), rather than forget it.

    Grains do not scatter the force of these cuts, so the difference is a vibration that nothing forces.
    """
    one, other = (
        march(replace(trials, scatter=0.0, entry=entry), _TURNS, _PER_TURN).force[:, :, :2]
        for entry in (_ENTRY, _ENTRY + 1)
    )
    apart = np.abs(one - other)[:, -_WINDOWS * _WINDOW * _PER_TURN :].max(axis=2)
    largest = apart.reshape(len(apart), _WINDOWS, -1).max(axis=2)
    forgotten = largest[:, 1:] < _FORGOTTEN * np.abs(one).max(axis=(1, 2))[:, None]
    return np.asarray(((largest[:, 1:] > largest[:, :-1]) & ~forgotten).any(axis=1))


def _between_orders(history: History) -> Array:
    """Frequency (n,), Hz, of the strongest line of the force in the plane that no turn repeats.

    What repeats changes slowly as the feed turns: at each angle of the spindle a polynomial over the turns.
    """
    turns = history.force[:, -_RECORDED * _PER_TURN :, :2].reshape(len(history.dt), -1, _PER_TURN, 2)
    slow = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, turns.shape[1]), _DEGREE)
    free = turns - np.einsum("tu,nupd->ntpd", slow @ np.linalg.pinv(slow), turns)
    count = turns.shape[1] * _PER_TURN
    tapered = free.reshape(len(turns), count, 2) * np.hanning(count)[:, None]
    power = (np.abs(np.fft.rfft(tapered, 16 * count, axis=1)) ** 2).sum(axis=2)
    return np.asarray(np.argmax(power, axis=1) / (16 * count * history.dt))


def _row(folder: Path, tested: Tested, test: int, place: int, rng: np.random.Generator) -> Row:
    """Row of the run table of a test whose record and trace are written."""
    name, rpm = f"h{place + 1:02d}", float(tested.trials.rpm[test])
    time, read = _recorded(tested, test, rng)
    x, z = trace(tested, test, rng)
    write_signal(folder / f"profiles/{name}.parquet", {"x_mm": x / MM, "z_mm": z / MM})
    depth = round(float(tested.trials.depth[test]) / MM, 4)
    loud = bool(tested.unstable[test]) ^ (place == _MISHEARD)
    return {
        "run": name,
        "role": "validate",
        "condition": f"{rpm:g}-{depth:g}",
        "replicate": 1,
        "order": place + 1,
        "operation": "helical",
        "spindle_rpm": rpm,
        "feed_per_tooth_mm": _FEED_MM,
        "axial_depth_mm": depth,
        "radial_depth_mm": 2.0 * _RADIUS_MM,
        "direction": "slot",
        "orbit_rpm": round(rpm * _TURN / (2.0 * math.pi), 4),
        "cut_length_mm": round(2.0 * math.pi * _ORBIT_MM, 1),
        "pose": "1",
        "dynamometer": write_force(folder, name, time, read),
        "profile": f"profiles/{name}.parquet",
        "stable": "no" if loud else "yes",
    }


def _recorded(tested: Tested, test: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Time and force of a test in full cut, sampled finely and filtered before it is thinned out."""
    sensor = Dynamometer(_FINER * RATE, "work", np.eye(3), noise=math.sqrt(_FINER) * _NOISE)
    turn = 60.0 / float(tested.trials.rpm[test])
    before = (_TURNS - _RECORDED) * turn
    time, read = record(*(sensor, lambda t: tested.history.at(test, t + before), (_RECORDED - 2) * turn, rng))
    return time[::_FINER], resample_poly(read, 1, _FINER, padtype="line")


def trace(tested: Tested, test: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Stylus trace (x, z) around the wall of the hole: each tooth leaves its reach where it points outwards.

    The orbit is counter-clockwise, so the wall is to the right of the feed. The furthest of the arcs that
    overlap remains. Passes of later orbits, which touch the wall once more, are left out.
    """
    trials, history = tested.trials, tested.history
    per_turn = 2.0 * math.pi + _TURN  # by what a tooth turns against the feed
    passes = []
    for tooth in range(_TEETH):
        # a tooth stands at 2π turn + 2π tooth / N from +y clockwise, and the wall at π less the feed's turn
        turn = (math.pi - 2.0 * math.pi * tooth / _TEETH + 2.0 * math.pi * np.arange(_TURNS)) / per_turn
        turn = turn[(turn > _ENTRY) & (turn < _TURNS - 1)]
        tip = history.at(test, turn * _PER_TURN * history.dt[test], "tip")
        out = np.stack([np.sin(_TURN * turn), -np.cos(_TURN * turn)], axis=1)
        runs_out = trials.runout * math.cos(trials.runout_angle - 2.0 * math.pi * tooth / _TEETH)
        passes.append(np.stack([HOLE_MM * MM / 2.0 * _TURN * turn, (tip * out).sum(axis=1) + runs_out]))
    along, reach = np.concatenate(passes, axis=1)
    spacing, noise = _PROFILER
    x = np.arange(along.max() - _TRACE_MM * MM, along.max(), spacing * MM)
    apart = along[None, :] - x[:, None]
    flatter = 0.5 * (1.0 / (_RADIUS_MM * MM) - 2.0 / (HOLE_MM * MM))  # of the tool's arc, in the hole's
    wall = np.max(np.where(np.abs(apart) < 0.8 * MM, reach - flatter * apart**2, -1.0), axis=1)
    return x - x[0], -wall + noise * UM * rng.standard_normal(len(x))


def _manifest(name: str) -> Row:
    shear = {"ktc_n_mm2": 10145, "krc_n_mm2": 11036.5, "kac_n_mm2": 5000}
    edge = {"kte_n_mm": 5.9192, "kre_n_mm": 1.0003, "kae_n_mm": 2.1432}
    return {
        "format": 1,
        "batch": name,
        "title": "Chatter tests in helical milling of Ti6Al4V, with records and stylus traces",
        "source": "simulated",
        "cell": "trimule",
        "tool": {"diameter_mm": 12, "teeth": _TEETH, "helix_deg": 0, "pitch_deg": [90, 90, 90, 90]},
        "work": {"material": "Ti6Al4V", "size_mm": [120, 80, 12]},
        "hole_diameter_mm": HOLE_MM,
        "coefficients": shear | edge,
        "instruments": {
            "dynamometer": {"rate_hz": RATE, "reads": "work", "range_n": 5000, "noise_n": _NOISE},
            "profiler": {"spacing_mm": _PROFILER[0], "sigma_mm": 2e-5},
            "hammer": {"rate_hz": 2048, "window": "none"},
        },
    }
