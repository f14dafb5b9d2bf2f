"""How often chatter is told right in the records of simulated tests, and how sure the answer may be.

Tests of :mod:`chatter_trials` that no constant was fitted to: 85 of tools with two, three, four and six teeth
each. Only those are left out that 5 % of depth turns over. A test that flips in step with the spindle, as
those of even numbers of teeth can, has no line of its own: it counts as wrong where it is called stable.
An answer of one half is "cannot be told". Run: ``pytest benchmarks/bench_chatter.py -o
python_files='bench_*.py' -s``.
"""

from itertools import pairwise

import numpy as np
import pytest
from chatter_trials import TEETH, settings, trials

from metro.signals.chatter import UNDECIDED, detect

SEED, COUNT = 202, 85
BINS = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98, 1.0)
CLASSES = ("forced", "hopf", "flip", "unknown")


@pytest.fixture(scope="module")
def told():
    """Tests off the boundary, and what their records say."""
    made = [test for teeth in TEETH for test in trials(settings(COUNT, teeth, SEED), SEED)]
    off = [test for test in made if test.unstable >= 0]
    return off, [detected(test) for test in off]


def detected(test):
    """Detection in the record of a test."""
    return detect(test.time, test.angle, test.signal, test.setting.teeth)


def true_kind(test):
    if test.unstable == 0:
        return "forced"
    return "flip, in step" if test.locked else "flip" if test.flips else "hopf"


def test_told_right(told):
    off, found = told
    p = np.array([one.probability for one in found])
    unstable, locked = (np.array([getattr(test, name) for test in off]) for name in ("unstable", "locked"))
    open_ = p == UNDECIDED
    right = ((p > UNDECIDED) == (unstable > 0)) & ~open_
    print(f"\n{len(off)} tests off the boundary: {unstable.sum()} chatter, {locked.sum()} in step")
    shares = {"cannot be told": open_, "right": right, "right but for those in step": right[~locked]}
    shares |= {"right where told": right[~open_]}
    print(", ".join(f"{name} {100 * share.mean():.1f} %" for name, share in shares.items()))
    for name in ("forced", "hopf", "flip", "flip, in step"):
        here = [one.kind for test, one in zip(off, found, strict=True) if true_kind(test) == name]
        print(f"  {name:14}", *(f"{kind} {here.count(kind)}" for kind in CLASSES), sep="  ")
    groups = {f"{teeth} teeth": np.array([t.setting.teeth == teeth for t in off]) for teeth in TEETH}
    groups |= {"tacho": np.array([t.setting.tacho for t in off])}
    groups["no tacho"] = ~groups["tacho"]
    groups["fewer than 60 turns"] = np.array([t.setting.turns < 60 for t in off])
    deep = np.abs(np.log([t.setting.deep for t in off]))
    groups |= {"within 20 % of the lobes": deep < np.log(1.2), "beyond": deep >= np.log(1.2)}
    for name, mask in groups.items():
        print(f"  {name:26}{100 * right[mask].mean():6.1f} % of {mask.sum()}")
    assert right.mean() >= 0.95


def test_the_probability_holds(told):
    off, found = told
    p, y = np.array([one.probability for one in found]), np.array([test.unstable for test in off])
    print(f"\nBrier score {np.mean((p - y) ** 2):.4f}")
    for low, high in pairwise(BINS):
        here = (p >= low) & (p < high) & (p != UNDECIDED)
        if here.any():
            print(f"  {low:4.2f} to {high:4.2f}: {here.sum():4} tests", end="")
            print(f", said {p[here].mean():.3f}, chatter {y[here].mean():.3f}")
    assert np.mean((p - y) ** 2) < 0.03


def test_the_frequency_is_the_tips_own(told):
    pairs = [
        (one.chatter_hz - test.hz, one.chatter_sd_hz, test.setting)
        for test, one in zip(*told, strict=True)
        if np.isfinite(one.chatter_hz) and np.isfinite(test.hz)
    ]
    passing = np.array([setting.rpm / 60.0 for *_, setting in pairs])
    error, sd = np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
    # the force also holds the chatter shifted by whole tooth passings, and one of these lines may be its
    # strongest, above all where an instrument's own resonance lifts it
    shift = np.array([setting.teeth for *_, setting in pairs]) * passing
    same = np.abs(error) < 0.05 * passing
    beside = np.min([np.abs(np.abs(error) % shift), shift - np.abs(error) % shift], axis=0) < 0.05 * passing
    print(f"\n{len(pairs)} frequencies: {100 * same.mean():.1f} % the tip's own", end="")
    print(f", {100 * (same | beside).mean():.1f} % but for whole tooth passings")
    own = np.abs(error[same]) / passing[same]
    print(f"median error {np.median(own):.5f} orders, 95 % within {np.quantile(own, 0.95):.4f}")
    print(f"within two standard deviations {100 * np.mean(np.abs(error[same]) < 2 * sd[same]):.0f} %")
    assert (same | beside).mean() > 0.75
