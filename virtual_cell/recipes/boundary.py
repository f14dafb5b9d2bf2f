"""Tests on either side of the stability boundary, of a machine that hides what its impact test does not show.

The receptances are those of the machine at rest, struck along x and y, without the mode that is missing; the
tests are made on the machine as it is. Whole spindle speeds are held out. Without a seed, machine and tests
are always the same.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.flexible import Machine, Programme
from virtual_cell.hammer import receptance
from virtual_cell.hidden import BOUNDARY_EFFECTS, Parameters
from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.recipes import boundary_world
from virtual_cell.recipes.boundary_draws import drawn_machine, drawn_programme
from virtual_cell.regeneration import History, Trials, march
from virtual_cell.session import write_force
from virtual_cell.units import MM, N_MM2, Array
from virtual_cell.write import (
    RUN_COLUMNS,
    Row,
    fresh_folder,
    impact_row,
    write_csv,
    write_signal,
    write_yaml,
)

MODES = (
    Modes(np.array([310.0]), np.array([0.03]), np.array([9e6])),
    Modes(np.array([392.0]), np.array([0.035]), np.array([7e6])),
)
LAW = in_millimetres((800.0, 320.0, 100.0), (0.0, 0.0, 0.0), (0.0, 0.0))
DIAMETER_MM, TEETH, FEED_MM, RADIAL_MM = 12.0, 3, 0.06, 5.0
RPM = tuple(float(rpm) for rpm in range(2400, 6000, 400))
HELD_OUT = RPM[1::3]
MACHINE = Machine(MODES, LAW, DIAMETER_MM * MM, TEETH, FEED_MM * MM, RADIAL_MM * MM, "down")
PROGRAMME = Programme(
    RPM,
    HELD_OUT,
    tuple(round(float(a), 2) * MM for a in np.geomspace(0.4, 6.8, 12)),
    beside=2,
    declared=(LAW.ktc, LAW.krc),
)
_WITHIN = 0.75  # of the speeds: a boundary within the depths that are tried
_TURNS, _LAST, _ENTRY, _SCATTER = 90, 20, 5, 0.01
_VISIBLE = 0.25  # of the feed per tooth: range, over the last turns, of what would repeat: called chatter
_RATE = 8192.0


@dataclass(frozen=True)
class Tested:
    """The tests that are kept of a march: their places in it, and what they were.

    ``repeats``: in a turn, of a cut without chatter. ``within``: share of the speeds whose boundary lies
    within the depths that were tried.
    """

    trials: Trials
    history: History
    kept: np.ndarray
    unstable: np.ndarray
    per_turn: int
    repeats: int
    within: float

    @property
    def rpm(self) -> Array:
        """(n,) rev/min."""
        return np.asarray(self.trials.rpm[self.kept])

    @property
    def depth(self) -> Array:
        """(n,) m."""
        return np.asarray(self.trials.depth[self.kept])

    def chatter_hz(self) -> Array:
        """Strongest frequency (n,), Hz, of the tip beside what repeats anyway; NaN where it is stable."""
        frequency = np.full(len(self.kept), np.nan)
        for i in np.flatnonzero(self.unstable):
            tip = self.history.tip[self.kept[i], -_LAST * self.per_turn :]
            spectrum = np.abs(np.fft.rfft(tip * np.hanning(len(tip))[:, None], axis=0)).sum(axis=1)
            order = np.arange(len(spectrum)) / _LAST
            kept = self.repeats * np.round(order / self.repeats)
            spectrum[np.abs(order - kept) < 2.5 / _LAST] = 0.0
            frequency[i] = order[spectrum.argmax()] * self.rpm[i] / 60.0
        return frequency


def cut_tests(
    hidden: Mapping[str, Parameters], machine: Machine = MACHINE, programme: Programme = PROGRAMME
) -> Tested:
    """March tests at every speed and depth, and keep those on either side of the boundary.

    ``hidden``: effects by the names, with the parameters, of the contract.
    """
    for name, parameters in hidden.items():
        machine = BOUNDARY_EFFECTS[name].apply(machine, parameters)
    rpm, depth = (a.ravel() for a in np.meshgrid(programme.rpm, programme.depths, indexing="ij"))
    trials = machine.trials(rpm, depth, scatter=_SCATTER, entry=_ENTRY)
    history = march(trials, _TURNS, programme.per_turn, programme.seed)
    period = programme.per_turn // machine.repeats
    last = history.tip[:, -_LAST * programme.per_turn :].reshape(len(rpm), -1, period, 2)
    unstable = np.ptp(last, axis=1).max(axis=(1, 2)) > _VISIBLE * machine.feed
    kept: list[int] = []
    within = 0
    for speed in programme.rpm:
        here = np.flatnonzero(rpm == speed)
        first = int(np.argmax(unstable[here])) if unstable[here].any() else len(here)
        within += 0 < first < len(here)
        kept += here[max(0, first - programme.beside) : first + programme.beside].tolist()
    places = np.array(kept)
    label = unstable[places] ^ _wrong(len(kept), machine.mislabelled, programme.seed)
    share = within / len(programme.rpm)
    return Tested(trials, history, places, label, programme.per_turn, machine.repeats, share)


def _wrong(tests: int, share: float, seed: int) -> np.ndarray:
    """Which labels (n,) are wrong: a share of them, at least one where it is not zero."""
    count = max(1, round(share * tests)) if share else 0
    wrong = np.zeros(tests, dtype=bool)
    wrong[np.random.default_rng([seed, 5]).permutation(tests)[:count]] = True
    return wrong


def make(
    folder: Path,
    hidden: Mapping[str, Parameters | None] | None = None,
    seed: int | None = None,
    style: str = "a",
    *,
    records: bool = False,
) -> Row:
    """Write the batch; return the truth.

    Parameters
    ----------
    hidden : effects by name, with their parameters; None: drawn by the seed.
    seed : of machine and tests. None: those that are always the same.
    style : in which the tests are drawn; ``c`` and ``d`` are those of the harder world.
    records : write the record of every test, whatever is drawn. A label that a record shows cannot be wrong:
        where labels are wrong, none is drawn.

    Raises
    ------
    KeyError
        For an effect that is not known.
    """
    if style in boundary_world.STYLES:
        return boundary_world.make(folder, hidden or {}, seed or 0, style, records=records)
    if seed is None:
        machine, programme = MACHINE, replace(PROGRAMME, records=records)
        rng = np.random.default_rng(1911)
        effects = {name: given or {} for name, given in (hidden or {}).items()}
        done = cut_tests(effects)
    else:
        machine, programme, effects, done = _drawn(hidden or {}, seed, style)
        drawn = programme.records and "wrong_labels" not in effects
        programme = replace(programme, records=drawn or records)
        rng = np.random.default_rng([seed, 19])
    fresh_folder(folder)
    rows = [_row(machine, programme, done, i) for i in range(len(done.kept))]
    if programme.records:
        for i, row in enumerate(rows):
            row["dynamometer"] = _recorded(folder, row["run"], done, i, rng)
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_csv(folder / "impacts.csv", _impacts(folder, machine, programme, rng))
    write_yaml(folder / "batch.yaml", _manifest(folder.name, machine, programme))
    drawing: Row = {} if seed is None else {"seed": seed, "style": style}
    return {"batch": folder.name, **drawing, "effects": effects}


def _drawn(
    hidden: Mapping[str, Parameters | None], seed: int, style: str
) -> tuple[Machine, Programme, dict[str, Parameters], Tested]:
    """Draw machine, tests and effects until the depths hold the boundary at most speeds."""
    for attempt in itertools.count():
        rng = np.random.default_rng([seed, 17, attempt])
        machine = drawn_machine(rng)
        programme = drawn_programme(rng, machine, style, seed)
        effects = {name: given or BOUNDARY_EFFECTS[name].draw(rng, machine) for name, given in hidden.items()}
        done = cut_tests(effects, machine, programme)
        if done.within >= _WITHIN:
            break
    return machine, programme, effects, done


def _row(machine: Machine, programme: Programme, done: Tested, test: int) -> Row:
    rpm, depth = float(done.rpm[test]), round(float(done.depth[test]) / MM, 3)
    return {
        "run": f"t{test + 1:02d}",
        "role": "validate" if rpm in programme.held_out else "identify",
        "condition": f"{rpm:g}",
        "replicate": 1,
        "order": test + 1,
        "operation": "slot" if machine.direction == "slot" else "side",
        "spindle_rpm": rpm,
        "feed_per_tooth_mm": round(machine.feed / MM, 6),
        "axial_depth_mm": depth,
        "radial_depth_mm": round(machine.radial / MM, 6),
        "direction": machine.direction,
        "feed_direction_deg": 0.0,
        "cut_length_mm": round(machine.feed / MM * machine.teeth * _TURNS, 1),
        "pose": "1",
        "stable": "no" if done.unstable[test] else "yes",
    }


def _recorded(folder: Path, run: str, done: Tested, test: int, rng: np.random.Generator) -> str:
    """Write the record of the force of a test; return its file."""
    rpm, place = float(done.rpm[test]), done.kept[test]
    start, seconds = _ENTRY * 60.0 / rpm, (_TURNS - _ENTRY - 2) * 60.0 / rpm
    sensor = Dynamometer(_RATE, "work", np.eye(3), noise=1.0)
    time, read = record(sensor, lambda t: done.history.at(place, t + start), seconds, rng)
    return write_force(folder, run, time, read)


def _impacts(folder: Path, machine: Machine, programme: Programme, rng: np.random.Generator) -> list[Row]:
    """Write the receptances along x and y, of the tool at rest, with their noise."""
    frequency = np.arange(*programme.band, 1.0)
    rows: list[Row] = []
    for axis, modes in zip("xy", machine.modes, strict=True):
        frf = receptance(modes, frequency)
        sd = programme.hammer_noise * np.abs(frf).max() / math.sqrt(2.0)
        noise = rng.normal(size=(2, len(frequency))) * sd
        file = f"impacts/1{axis}.parquet"
        columns = {"frequency_hz": frequency, "real": frf.real + noise[0], "imag": frf.imag + noise[1]}
        write_signal(folder / file, columns)
        rows.append(impact_row(f"1{axis}", file, "frf", "m"))
    return rows


def _manifest(name: str, machine: Machine, programme: Programme) -> Row:
    how = "slots" if machine.direction == "slot" else f"{machine.direction} milling"
    ktc, krc = (round(k / N_MM2) for k in programme.declared)
    return {
        "format": 1,
        "batch": name,
        "title": f"Tests on either side of the stability boundary, {how}",
        "source": "simulated",
        "cell": "unknown",
        "tool": {
            "diameter_mm": round(machine.diameter / MM, 6),
            "teeth": machine.teeth,
            "helix_deg": 0,
            "pitch_deg": [round(360 / machine.teeth)] * machine.teeth,
        },
        "work": {"material": "AA7075", "size_mm": [100, 60, 30]},
        "coefficients": {
            "ktc_n_mm2": ktc,
            "krc_n_mm2": krc,
            "kac_n_mm2": round(machine.law.kac / N_MM2),
            "kte_n_mm": 0,
            "kre_n_mm": 0,
            "kae_n_mm": 0,
        },
        "instruments": {"dynamometer": {"rate_hz": _RATE, "reads": "work", "range_n": 5000, "noise_n": 1.0}},
    }
