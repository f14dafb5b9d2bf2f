"""Damaged files of every kind are read or refused; `fuzz.py` does the same with as many as one likes."""

import random
import tempfile
import time
import warnings
from pathlib import Path

import fuzz_targets
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

EXAMPLES = 20
SCRATCH = tempfile.TemporaryDirectory()
MADE = Path(SCRATCH.name) / "made"
MADE.mkdir()
TARGETS = list(fuzz_targets.targets(MADE))


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_a_damaged_file_is_read_or_refused(target, tmp_path):
    folder = fuzz_targets.prepared(target, tmp_path)

    @settings(
        max_examples=EXAMPLES // 5 if target.slow else EXAMPLES,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=HealthCheck,
    )
    @given(st.integers(0, 2**32))
    def fuzzed(seed):
        rng = random.Random(seed)
        data = target.mutate(target.sample, rng.choice(TARGETS).sample, rng)
        begun = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fuzz_targets.outcome(target, folder, data)
        assert time.process_time() - begun < 5.0

    fuzzed()


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_the_sample_itself_is_read(target, tmp_path):
    assert fuzz_targets.outcome(target, fuzz_targets.prepared(target, tmp_path), target.sample)
