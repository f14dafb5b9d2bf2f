"""Chatter tests with their records and stylus traces: slots on the published machine at its first position.

The labels are those of an operator who mishears some.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.milling import Coefficients
from virtual_cell.recipes.trimule import MODES, TITANIUM, impacts
from virtual_cell.regeneration import History, Trials, march
from virtual_cell.session import write_force
from virtual_cell.units import MM, UM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

RATE = 2048.0
_FEED_MM, _TEETH = 0.02, 4
_RPM = (1000.0, 1500.0, 2000.0, 2500.0)
_DEPTHS_MM = (0.01, 0.03, 0.06, 0.1, 0.15)
_RUNOUT_UM = 4.0
_TURNS, _ENTRY, _PER_TURN = 110, 15, 120
_VISIBLE = 0.5  # of the feed per tooth: range over the turns that is chatter
_MISHEARD = (3, 11)  # tests with a wrong label
_PROFILER = (0.01, 0.02)  # spacing, noise, mm and µm
# the edge forces, which the theory of the lobes takes to drop out, are a tenth of the published ones
_LAW = Coefficients(
    TITANIUM.ktc, TITANIUM.krc, TITANIUM.kac, 0.1 * TITANIUM.kte, 0.1 * TITANIUM.kre, 0.1 * TITANIUM.kae
)


@dataclass(frozen=True)
class _Tested:
    """What really happened: the tests, their history, and which of them chattered (n,)."""

    trials: Trials
    history: History
    unstable: np.ndarray


def make(folder: Path) -> Row:
    """Write the batch; return the truth."""
    rng = np.random.default_rng(1954)
    tested = _tested()
    fresh_folder(folder)
    rows = [_row(folder, tested, test, rng) for test in range(len(tested.unstable))]
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "impacts.csv", impacts(folder, rng))
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "unstable": [bool(u) for u in tested.unstable], "misheard": list(_MISHEARD)}


def _tested() -> _Tested:
    rpm, depth = (a.ravel() for a in np.meshgrid(_RPM, np.array(_DEPTHS_MM) * MM, indexing="ij"))
    modes = (MODES["x"], MODES["z"])
    trials = Trials(
        modes, _LAW, _TEETH, _FEED_MM * MM, rpm, depth, _RUNOUT_UM * UM, 0.3, scatter=0.02, entry=_ENTRY
    )
    history = march(trials, _TURNS, _PER_TURN)
    last = history.tip[:, -30 * _PER_TURN :].reshape(len(rpm), 30, _PER_TURN, 2)
    spread = np.ptp(last, axis=1).max(axis=(1, 2))
    return _Tested(trials, history, spread > _VISIBLE * _FEED_MM * MM)


def _row(folder: Path, tested: _Tested, test: int, rng: np.random.Generator) -> Row:
    """Row of the run table of a test whose record and trace are written."""
    name, rpm = f"t{test + 1:02d}", float(tested.trials.rpm[test])
    sensor = Dynamometer(RATE, "work", np.eye(3), noise=1.0)
    seconds = (_TURNS - _ENTRY - 2) * 60.0 / rpm
    full = _ENTRY * 60.0 / rpm
    time, read = record(sensor, lambda t: tested.history.at(test, t + full), seconds, rng)
    x, z = _trace(tested, test, rng)
    write_signal(folder / f"profiles/{name}.parquet", {"x_mm": x / MM, "z_mm": z / MM})
    depth = round(float(tested.trials.depth[test]) / MM, 4)
    loud = bool(tested.unstable[test]) ^ (test in _MISHEARD)
    return {
        "run": name,
        "role": "validate",
        "condition": f"{rpm:g}-{depth:g}",
        "replicate": 1,
        "order": test + 1,
        "operation": "slot",
        "spindle_rpm": rpm,
        "feed_per_tooth_mm": _FEED_MM,
        "axial_depth_mm": depth,
        "radial_depth_mm": 12.0,
        "direction": "slot",
        "feed_direction_deg": 0.0,
        "cut_length_mm": round(_FEED_MM * _TEETH * _TURNS, 1),
        "pose": "1",
        "dynamometer": write_force(folder, name, time, read),
        "profile": f"profiles/{name}.parquet",
        "stable": "no" if loud else "yes",
    }


def _trace(tested: _Tested, test: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Stylus trace (x, z) along the side of the slot: each tooth leaves its reach as it passes that side.

    The lowest of the arcs that overlap remains: towards the axis, the wall is what no tooth reached.
    """
    trials, steps = tested.trials, _PER_TURN // _TEETH
    tip = tested.history.tip[test, _ENTRY * _PER_TURN :: steps, 1]
    tooth = np.arange(len(tip)) % _TEETH
    reach = tip + trials.runout * np.cos(trials.runout_angle + 2.0 * np.pi * tooth / _TEETH)
    passed = trials.feed * np.arange(len(tip))
    spacing, noise = _PROFILER
    x = np.arange(passed[0], passed[-1], spacing * MM)
    nearest = passed[None, :] - x[:, None]
    wall = np.max(np.where(np.abs(nearest) < 0.5 * MM, reach - nearest**2 / (12.0 * MM), -1.0), axis=1)
    return x, -wall + noise * UM * rng.standard_normal(len(x))


def _manifest(name: str) -> Row:
    shear = {"ktc_n_mm2": 10145, "krc_n_mm2": 11036.5, "kac_n_mm2": 5000}
    edge = {"kte_n_mm": 59.192, "kre_n_mm": 10.003, "kae_n_mm": 21.432}
    return {
        "format": 1,
        "batch": name,
        "title": "Chatter tests in slots of Ti6Al4V, with records and stylus traces",
        "source": "simulated",
        "cell": "trimule",
        "tool": {"diameter_mm": 12, "teeth": _TEETH, "helix_deg": 0, "pitch_deg": [90, 90, 90, 90]},
        "work": {"material": "Ti6Al4V", "size_mm": [120, 80, 12]},
        "coefficients": shear | edge,
        "instruments": {
            "dynamometer": {"rate_hz": RATE, "reads": "work", "range_n": 5000, "noise_n": 1.0},
            "profiler": {"spacing_mm": _PROFILER[0], "sigma_mm": 2e-5},
            "hammer": {"rate_hz": 2048, "window": "none"},
        },
    }
