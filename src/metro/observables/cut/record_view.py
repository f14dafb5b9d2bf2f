"""Raw records reduced for figures: the span of the force along each record, and the hits of a hammer.

Tables ``force_records`` (least and greatest value of each stretch of a record) and ``hit_records`` (force of
each hit about its peak, and its spectrum relative to its level at low frequency).
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.cut.long_record import AXES, LongRecord
from metro.observables.force.orders import recorded
from metro.units import Array

STRETCHES = 160  # of a record
MOST_RUNS, MOST_HITS = 24, 24
HIT = ["test", "position", "reference", "replicate"]
LOW = 0.02  # lowest share of the band, whose mean level is the reference of a hit's spectrum


def record_tables(batch: Batch, read: Tables, checks: pd.DataFrame | None) -> dict[str, pd.DataFrame]:
    """Return both tables; of many records, take those that failed a check and then the first ones.

    Parameters
    ----------
    checks : of the raw data, ``run, ok``.
    """
    runs = recorded(batch)
    failed = set() if checks is None else set(checks.loc[~checks["ok"].astype(bool), "run"].astype(str))
    chosen = sorted(runs, key=lambda run: run not in failed)[:MOST_RUNS]
    spans = [_span(LongRecord(read, run), run) for run in runs if run in chosen]
    tables = {"force_records": pd.concat(spans, ignore_index=True)} if spans else {}
    hits = _hits(read("hit"))
    return tables | ({"hit_records": hits} if len(hits) else {})


def _span(record: LongRecord, run: str) -> pd.DataFrame:
    """Return least and greatest force of each stretch of a record: ``run, t_s, axis, low_n, high_n``."""
    count = min(STRETCHES, record.samples)
    if not count:
        return pd.DataFrame(columns=["run", "t_s", "axis", "low_n", "high_n"])
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    done = 0
    for piece in record.stretches():
        place = (done + np.arange(len(piece.time))) * count // record.samples
        first, start = np.unique(place, return_index=True)
        low[first] = np.minimum(low[first], np.minimum.reduceat(piece.signal, start))
        high[first] = np.maximum(high[first], np.maximum.reduceat(piece.signal, start))
        done += len(piece.time)
    time = record.start + (np.arange(count) + 0.5) * (record.end - record.start) / count
    return pd.concat(
        [
            pd.DataFrame({"run": run, "t_s": time, "axis": name[1], "low_n": low[:, i], "high_n": high[:, i]})
            for i, name in enumerate(AXES)
        ],
        ignore_index=True,
    )


def _hits(table: pd.DataFrame) -> pd.DataFrame:
    """Return the force of each hit about its peak and over frequency: ``hit, part, x, value``.

    ``part``: ``pulse`` (x in ms from the peak, value in N) or ``spectrum`` (x in Hz, value in dB).
    """
    parts = []
    for name, responses in list(table.groupby(HIT, sort=False))[:MOST_HITS]:
        hit = responses[responses["response"] == responses["response"].iloc[0]]  # each has the same force
        time, force = hit["t_s"].to_numpy(float), hit["force_n"].to_numpy(float)
        hit_name = ", ".join(map(str, name))
        peak = int(np.argmax(np.abs(force)))
        near = slice(*_about(force, peak))
        pulse = pd.DataFrame({"x": 1e3 * (time[near] - time[peak]), "value": force[near], "part": "pulse"})
        frequency, level = _spectrum(time, force)
        spectrum = pd.DataFrame({"x": frequency, "value": level, "part": "spectrum"})
        parts.append(pd.concat([pulse, spectrum]).assign(hit=hit_name))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _about(force: Array, peak: int) -> tuple[int, int]:
    """Return the ends of the stretch about a hit's peak; its length grows with the width of the pulse."""
    above = np.flatnonzero(np.abs(force) > 0.1 * abs(force[peak]))
    inside = above[np.abs(above - peak) <= max(8, len(above))]
    reach = max(8, 3 * (int(inside[-1]) - int(inside[0]) + 1))
    return max(0, peak - reach), min(len(force), peak + 2 * reach)


def _spectrum(time: Array, force: Array) -> tuple[Array, Array]:
    step = (time[-1] - time[0]) / (len(time) - 1)
    amplitude = np.abs(np.fft.rfft(force - np.median(force)))
    frequency = np.fft.rfftfreq(len(force), step)
    low = amplitude[1 : max(2, int(LOW * len(amplitude)))].mean()
    level = 20.0 * np.log10(np.maximum(amplitude, 1e-6 * low) / low)
    thin = max(1, len(frequency) // 1500)
    return frequency[1::thin], level[1::thin]
