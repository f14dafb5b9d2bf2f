"""Tests on either side of the stability boundary, of a machine that hides what its impact test does not tell.

The receptances are those of the machine at rest, struck along x and y, without the mode that is missing; the
tests are made on the machine as it is. Whole spindle speeds are held out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.hammer import receptance
from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.regeneration import History, Trials, march
from virtual_cell.session import write_force
from virtual_cell.units import DEG, MM, N_MM, Array
from virtual_cell.write import RUN_COLUMNS, Row, fresh_folder, write_csv, write_signal, write_yaml

MODES = (
    Modes(np.array([310.0]), np.array([0.03]), np.array([9e6])),
    Modes(np.array([392.0]), np.array([0.035]), np.array([7e6])),
)
LAW = in_millimetres((800.0, 320.0, 100.0), (0.0, 0.0, 0.0), (0.0, 0.0))
DIAMETER_MM, TEETH, FEED_MM, RADIAL_MM = 12.0, 3, 0.06, 5.0
RPM = tuple(float(rpm) for rpm in range(2400, 6000, 400))
HELD_OUT = RPM[1::3]
DEPTHS_MM = tuple(round(float(a), 2) for a in np.geomspace(0.4, 6.8, 12))
BESIDE = 2  # tests kept on either side of the boundary, at each speed
_TURNS, _LAST, _PER_TURN, _ENTRY = 90, 20, 120, 5
_VISIBLE = 0.25  # of the feed per tooth: range over the last turns that is called chatter
_RATE = 8192.0


@dataclass(frozen=True)
class Tested:
    """The tests that are kept of a march: their places in it, and what they were."""

    trials: Trials
    history: History
    kept: np.ndarray
    unstable: np.ndarray

    @property
    def rpm(self) -> Array:
        """(n,) rev/min."""
        return np.asarray(self.trials.rpm[self.kept])

    @property
    def depth(self) -> Array:
        """(n,) m."""
        return np.asarray(self.trials.depth[self.kept])

    def chatter_hz(self) -> Array:
        """Strongest frequency (n,), Hz, of the tip off the orders of the spindle; NaN where it is stable."""
        found = np.full(len(self.kept), np.nan)
        for i in np.flatnonzero(self.unstable):
            tip = self.history.tip[self.kept[i], -_LAST * _PER_TURN :]
            spectrum = np.abs(np.fft.rfft(tip * np.hanning(len(tip))[:, None], axis=0)).sum(axis=1)
            order = np.arange(len(spectrum)) / _LAST
            spectrum[np.abs(order - np.round(order)) < 2.5 / _LAST] = 0.0
            found[i] = order[spectrum.argmax()] * self.rpm[i] / 60.0
        return found


def tested(hidden: Mapping[str, Any]) -> Tested:
    """March tests at every speed and depth, and keep those on either side of the boundary.

    ``hidden``: effects by the names, with the parameters, of the contract.
    """
    rpm, depth = (a.ravel() for a in np.meshgrid(RPM, np.array(DEPTHS_MM) * MM, indexing="ij"))
    trials = Trials(
        _modes(hidden, rpm),
        LAW,
        TEETH,
        FEED_MM * MM,
        rpm,
        depth,
        entry=_ENTRY,
        scatter=0.01,
        immersion=(math.pi - math.acos(1.0 - 2.0 * RADIAL_MM / DIAMETER_MM), math.pi),
        turned=hidden.get("mode_coupling", {}).get("angle_deg", 0.0) * DEG,
        ploughing=hidden.get("process_damping", {}).get("coefficient_n_mm", 0.0)
        * (N_MM / (0.5 * DIAMETER_MM * MM)),
    )
    history = march(trials, _TURNS, _PER_TURN)
    last = history.tip[:, -_LAST * _PER_TURN :].reshape(len(rpm), _LAST, _PER_TURN, 2)
    unstable = np.ptp(last, axis=1).max(axis=(1, 2)) > _VISIBLE * FEED_MM * MM
    kept: list[int] = []
    for speed in RPM:
        here = np.flatnonzero(rpm == speed)
        first = int(np.argmax(unstable[here])) if unstable[here].any() else len(here)
        kept += here[max(0, first - BESIDE) : first + BESIDE].tolist()
    places = np.array(kept)
    return Tested(trials, history, places, unstable[places])


def _modes(hidden: Mapping[str, Any], rpm: Array) -> tuple[Modes, Modes]:
    """Modes of the machine as it is, at each speed (n, m)."""
    change = hidden.get("spindle_speed_softening", {}).get("change_per_krpm", 0.0)
    factor = 1.0 + change * rpm[:, None] / 1000.0
    more = hidden.get("missing_mode")
    found = []
    for axis, known in zip("xy", MODES, strict=True):
        parts = [known.damped, known.damping, known.stiffness]
        if more and more["axis"] == axis:
            damped = more["frequency_hz"] * math.sqrt(1.0 - more["damping"] ** 2)
            added = (damped, more["damping"], more["stiffness_n_um"] * 1e6)
            parts = [np.append(part, value) for part, value in zip(parts, added, strict=True)]
        shape = np.ones_like(factor)
        found.append(Modes(parts[0] * np.sqrt(factor), parts[1] * shape, parts[2] * factor))
    return found[0], found[1]


def make(folder: Path, hidden: Mapping[str, Any] | None = None, *, records: bool = False) -> Row:
    """Write the batch, with the record of every test where ``records``; return the truth."""
    rng = np.random.default_rng(1911)
    effects = dict(hidden or {})
    done = tested(effects)
    fresh_folder(folder)
    rows = [_row(folder, done, i, rng if records else None) for i in range(len(done.kept))]
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "impacts.csv", _impacts(folder, rng))
    write_yaml(folder / "batch.yaml", _manifest(folder.name))
    return {"batch": folder.name, "effects": effects}


def _row(folder: Path, done: Tested, test: int, rng: np.random.Generator | None) -> Row:
    rpm, depth = float(done.rpm[test]), round(float(done.depth[test]) / MM, 3)
    name = f"t{test + 1:02d}"
    row: Row = {
        "run": name,
        "role": "validate" if rpm in HELD_OUT else "identify",
        "condition": f"{rpm:g}",
        "replicate": 1,
        "order": test + 1,
        "operation": "side",
        "spindle_rpm": rpm,
        "feed_per_tooth_mm": FEED_MM,
        "axial_depth_mm": depth,
        "radial_depth_mm": RADIAL_MM,
        "direction": "down",
        "feed_direction_deg": 0.0,
        "cut_length_mm": round(FEED_MM * TEETH * _TURNS, 1),
        "pose": "1",
        "stable": "no" if done.unstable[test] else "yes",
    }
    if rng is not None:
        start, place = _ENTRY * 60.0 / rpm, done.kept[test]
        sensor = Dynamometer(_RATE, "work", np.eye(3), noise=1.0)
        seconds = (_TURNS - _ENTRY - 2) * 60.0 / rpm
        time, read = record(sensor, lambda t: done.history.at(place, t + start), seconds, rng)
        row["dynamometer"] = write_force(folder, name, time, read)
    return row


def _impacts(folder: Path, rng: np.random.Generator) -> list[Row]:
    """Write the receptances along x and y, of the tool at rest, with half a percent of noise."""
    frequency = np.arange(60.0, 900.0, 1.0)
    rows: list[Row] = []
    for axis, modes in zip("xy", MODES, strict=True):
        frf = receptance(modes, frequency)
        noise = rng.normal(size=(2, len(frequency))) * 0.005 * np.abs(frf).max() / math.sqrt(2.0)
        file, point = f"impacts/1{axis}.parquet", f"1{axis}"
        columns = {"frequency_hz": frequency, "real": frf.real + noise[0], "imag": frf.imag + noise[1]}
        write_signal(folder / file, columns)
        rows.append(
            {
                "test": "tip",
                "position": "1",
                "reference": point,
                "response": point,
                "replicate": 1,
                "kind": "frf",
                "file": file,
                "response_unit": "m",
            }
        )
    return rows


def _manifest(name: str) -> Row:
    return {
        "format": 1,
        "batch": name,
        "title": "Tests on either side of the stability boundary, down milling",
        "source": "simulated",
        "cell": "unknown",
        "tool": {"diameter_mm": DIAMETER_MM, "teeth": TEETH, "helix_deg": 0, "pitch_deg": [120, 120, 120]},
        "work": {"material": "AA7075", "size_mm": [100, 60, 30]},
        "coefficients": {
            "ktc_n_mm2": 800,
            "krc_n_mm2": 320,
            "kac_n_mm2": 100,
            "kte_n_mm": 0,
            "kre_n_mm": 0,
            "kae_n_mm": 0,
        },
        "instruments": {"dynamometer": {"rate_hz": _RATE, "reads": "work", "range_n": 5000, "noise_n": 1.0}},
    }
