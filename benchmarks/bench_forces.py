"""Forces of one second at 10 kHz, N 4, helix 40°, runout on: this package against slices in plain numpy.

Peers, on circular paths: at every time sample the edge is cut into slices, and the forces are summed over
slices and teeth: vectorised over slices and teeth in a loop over the samples, and vectorised over the samples
as well. Each run starts without a table in the cache. Run: ``pytest
benchmarks/bench_forces.py -s``; the tests that print compare within the same run.
"""

import math
import time
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import force_basis
from metro.cutting.law import EdgeLaw
from metro.cutting.time_signal import time_signal

TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])
TOOL = Cutter(6e-3, math.radians(40), evenly_pitched(4), 8e-6, 0.7)
CUT = Cut(0.05e-3, 3e-3, Engagement(0.0, math.pi))
RATE, SPEED = 10_000, 2 * math.pi * 2000 / 60
SLICES_PER_RADIAN = 60
SLICES = math.ceil(SLICES_PER_RADIAN * TOOL.lag_per_depth * CUT.axial_depth)


def ours(samples, true_path=False):
    force_basis.cache_clear()
    moments = np.arange(samples) / RATE
    return time_signal(TOOL, EdgeLaw(), CUT, TITANIUM, speed=SPEED, time=moments, true_path=true_path)


def slice_tables():
    """What slices need of heights and teeth: lag (S, 1), clearance (passes, S, N), feed (passes,)."""
    teeth = TOOL.teeth
    lag = ((np.arange(SLICES) + 0.5) * CUT.axial_depth / SLICES * TOOL.lag_per_depth)[:, None]
    offset = TOOL.runout_radius * np.cos(TOOL.runout_angle - np.array(TOOL.tooth_angles) + lag)
    clearance = np.stack([offset - np.roll(offset, -m, axis=1) for m in range(1, teeth + 1)])
    return lag, clearance, CUT.feed_per_tooth * np.arange(1, teeth + 1)


def summed(angle, tables):
    """Sum over slices and teeth the forces at angles of any shape (…, 1, 1): (3, …)."""
    lag, clearance, feeds = tables
    phi = angle + np.array(TOOL.tooth_angles) - lag
    sine, cosine = np.sin(phi), np.cos(phi)
    chip = feeds[0] * sine + clearance[0]
    for feed, cleared in zip(feeds[1:], clearance[1:], strict=True):
        chip = np.minimum(chip, feed * sine + cleared)
    cutting = (sine > 0) & (chip > 0)
    dz = CUT.axial_depth / SLICES
    t, r, a = (np.where(cutting, TITANIUM[i] * chip + TITANIUM[i + 3], 0.0) * dz for i in range(3))
    return np.stack([part.sum(axis=(-2, -1)) for part in (-t * cosine - r * sine, t * sine - r * cosine, a)])


def slice_loop(samples):
    tables, force = slice_tables(), np.empty((samples, 3))
    for i in range(samples):
        force[i] = summed(SPEED * i / RATE, tables)
    return force


def slices_vectorised(samples, at_once=100):
    tables = slice_tables()
    angle = SPEED * np.arange(samples)[:, None, None] / RATE
    parts = np.array_split(angle, math.ceil(samples / at_once))
    return np.concatenate([summed(part, tables).T for part in parts])


def seconds(function, *arguments, repeats=5):
    """Best CPU time of some: what else the machine does is not counted."""
    best = math.inf
    for _ in range(repeats):
        start = time.process_time()
        function(*arguments)
        best = min(best, time.process_time() - start)
    return best


def test_one_second_at_10_khz(benchmark):
    assert np.all(np.isfinite(benchmark(ours, RATE)))


def test_one_second_at_10_khz_on_true_paths(benchmark):
    assert np.all(np.isfinite(benchmark(ours, RATE, True)))


def test_the_peers_compute_the_same_forces():
    found, loop, whole = ours(500), slice_loop(500), slices_vectorised(500)
    assert loop == pytest.approx(whole, abs=1e-9)
    # The peers let a slice enter at once, which is what they are off by.
    assert np.sqrt(np.mean((found - loop) ** 2)) < 0.02 * np.abs(found).max()


def test_ratios_to_real_time_and_to_the_peers():
    ours(10)  # imports
    circular, true = seconds(ours, RATE, repeats=20), seconds(ours, RATE, True, repeats=20)
    loop, whole = seconds(slice_loop, RATE, repeats=2), seconds(slices_vectorised, RATE)
    print(f"\n{'':30s}{'ms':>10s}{'× real time':>14s}{'× slice loop':>14s}{'× vectorised':>14s}")
    for name, spent in (
        ("circular paths, cold", circular),
        ("true paths, cold", true),
        ("slice loop over samples", loop),
        ("slices, all vectorised", whole),
    ):
        print(f"{name:30s}{1e3 * spent:10.2f}{1 / spent:14.0f}{loop / spent:14.1f}{whole / spent:14.1f}")
    assert 1 / max(circular, true) >= 200
    assert loop / max(circular, true) >= 20


def test_time_grows_with_the_samples_at_most_linearly():
    counts = np.array([10_000, 20_000, 50_000, 100_000, 200_000, 500_000])
    spent = np.array([seconds(ours, int(count), repeats=8) for count in counts])
    print(f"\n{'samples':>10s}{'ms':>10s}{'us/sample':>12s}")
    for count, each in zip(counts, spent, strict=True):
        print(f"{count:10d}{1e3 * each:10.2f}{1e6 * each / count:12.3f}")
    exponent = np.polyfit(np.log(counts[2:]), np.log(spent[2:]), 1)[0]
    print(f"exponent from {counts[2]} samples on: {exponent:.2f}")
    assert exponent < 1.2


def table(tool, cut, true_path):
    force_basis.cache_clear()
    force_basis(tool, EdgeLaw(), cut, true_path)


def test_rounded_ends_beside_the_flat_end():
    """A rounded end takes less than twice the time of the flat end, in the median."""
    radius, side = TOOL.radius, math.pi - math.acos(1.0 - 0.5)
    arcs = {"slot": Engagement(0.0, math.pi), "down": Engagement(side, math.pi)}
    print(f"\n{'ms of a revolution':36s}{'flat':>8s}{'ball':>8s}{'corner':>8s}{'ratios':>14s}")
    ratios: dict[bool, list[float]] = {True: [], False: []}
    for path, teeth, runout, (name, arc) in product((True, False), (2, 4), (0.0, 8e-6), arcs.items()):
        flat = Cutter(radius, math.radians(30), evenly_pitched(teeth), runout, 0.7)
        cut = replace(CUT, engagement=arc)
        ends = (flat, replace(flat, corner=radius), replace(flat, corner=0.3 * radius))
        spent = np.array([seconds(table, end, cut, path, repeats=40) for end in ends])
        ratios[path] += (spent[1:] / spent[0]).tolist()
        words = f"{'true' if path else 'circular'} paths, {teeth} teeth, {name}{', runout' if runout else ''}"
        times = "".join(f"{1e3 * each:8.2f}" for each in spent)
        print(f"{words:36s}{times}{spent[1] / spent[0]:8.2f}{spent[2] / spent[0]:6.2f}")
    print(f"in the median {np.median(ratios[True]):.2f} and {np.median(ratios[False]):.2f}")
    assert np.median(ratios[True]) < 2.0
    assert np.median(ratios[False]) < 2.0
