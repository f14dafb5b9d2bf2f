"""Records of every kind, as measured, and the copies of them that a check of clipping must tell apart."""

import os
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.registry import read

REAL = Path(os.environ.get("METRO_REAL_DATA", "/no/such/folder"))
FIELD = REAL.parent / "field"
SHARES = (0.98, 0.95, 0.8, 0.5)
BITS = (8, 10, 12)
LEAST = 5  # samples in a row: what the check calls flat


def measured():
    """Yield name and values of every record that was measured."""
    import scipy.io

    slots = REAL / "batches/slotting-d25/dyno"
    for file in sorted(slots.glob("*.csv")):
        table = read(file, "force")
        yield from ((f"slot {file.stem} {name}", table[name].to_numpy()) for name in ("fx_n", "fy_n", "fz_n"))
    hit = pd.read_parquet(REAL / "batches/tool-impact/impacts/hit-p1.parquet")
    yield from ((f"hit {name}", hit[name].to_numpy()) for name in ("force_n", "response"))
    for name, vector in sorted(scipy.io.loadmat(FIELD / "force-ball-d16/ball_d16.mat").items()):
        if not name.startswith("__"):
            yield f"ball {name}", np.ravel(vector).astype(float)
    for file in sorted((FIELD / "modal-duplicated-channel").glob("*.txt")):
        yield f"plate {file.stem}", np.loadtxt(file)[:, 1]
    for file in sorted((FIELD / "robot-ur10e-payload").glob("*.csv")):
        table = np.loadtxt(file, delimiter=",")
        yield from ((f"robot {file.stem} {place}", column) for place, column in enumerate(table.T))


def moving():
    """Yield the measured records that move, and are not clipped as they were recorded."""
    for name, values in measured():
        if np.ptp(values) > 0 and not name.startswith("plate accel-pt8") and not name.endswith(" 0"):
            yield name, values


def quantised(values, bits):
    """Round to the steps of a converter whose range is twice the record's largest value."""
    step = 2.0 * np.abs(values).max() / 2 ** (bits - 1)
    return step * np.round(values / step)


def levelled(values):
    """Take a straight line off and round to a millionth of the range, as a profile is exported."""
    place = np.arange(len(values))
    line = np.polyval(np.polyfit(place, values, 1), place)
    digits = np.ptp(values) / 1e6
    return digits * np.round((values - line) / digits)


def harmless(values):
    """Yield name and values of copies of a record that are as they are for another reason than clipping."""
    yield "as recorded", values
    for bits in BITS:
        coarse = quantised(values, bits)
        yield f"{bits} bit", coarse
        yield f"{bits} bit, levelled", levelled(coarse)
        yield f"{bits} bit, offset", coarse + 0.37 * np.ptp(values)
    for step in (2, 5, 10):
        yield f"every {step}th", values[::step]
    yield "levelled", levelled(values)
    yield "first tenth", values[: max(len(values) // 10, 50)]
    still = np.full(2000, values[0])
    yield "still before", np.concatenate((still, values))
    zero = 0.005 * np.ptp(values)
    yield "at zero before, one-sided", np.concatenate((still * 0.0, values - values.min())) + zero
    hit = np.concatenate((np.zeros(3 * len(values)), values[int(np.argmax(values)) :]))
    yield "at zero for most of it, one-sided", np.maximum(hit, 0.0) - zero


def made():
    """Yield name and values of waves that have flat tops by nature."""
    place = np.arange(8000)
    yield "square", np.where(place // 500 % 2, 1.0, -1.0)
    yield "steps", np.repeat([0.0, 0.2, 0.1, 0.5, 0.3, 0.5, 0.1], 400)
    ramped = np.interp(place % 1000, [0, 400, 500, 900, 1000], [0, 0, 1, 1, 0])
    yield "square with flanks, 10 bit", quantised(ramped + 1e-3 * np.sin(place), 10)
    for turns in (3, 10, 40):
        wave = np.sin(2 * np.pi * turns * place / len(place) + 0.3)
        yield from ((f"{turns} waves, {bits} bit", quantised(wave, bits)) for bits in BITS)
        yield from (
            (f"{turns} waves, {bits} bit, levelled", levelled(quantised(wave, bits))) for bits in BITS
        )


def clipped(values, share):
    """Return a record cut off at a share of both extremes; None where no ``LEAST`` samples in a row are."""
    low, high = share * values.min(), share * values.max()
    cut = np.clip(values, min(low, high), max(low, high))
    return cut if _longest(cut == cut.max()) >= LEAST or _longest(cut == cut.min()) >= LEAST else None


def _longest(true):
    edges = np.flatnonzero(np.diff(np.concatenate(([0], true.astype(np.int8), [0]))))
    return int((edges[1::2] - edges[::2]).max(initial=0))
