"""The bundled chatter tests through ingest and the lobes, against what the simulator knows to be true."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.batch.processed import Processed, read_batch
from metro.observables.stability import observable as lobes
from metro.observables.stability.chatter import observe_chatter
from metro.stages.ingest import ingest
from virtual_cell.recipes import chatter

ROOT = Path(__file__).parents[2]
BUNDLED = ROOT / "data" / "raw" / "trimule-chatter"
MISHEARD = "h04"
NO_MODES = pd.DataFrame({"used": [], "frequency_hz": [], "damping": []})


@pytest.fixture(scope="module")
def processed(tmp_path_factory):
    out = tmp_path_factory.mktemp("chatter")
    ingest(BUNDLED, ROOT / "config" / "cells", out, {}, "")
    return out


@pytest.fixture(scope="module")
def observed(processed):
    return observe_chatter(read_batch(processed), Processed(processed), NO_MODES).set_index("run")


def test_the_records_show_which_cuts_chattered_and_the_label_that_is_wrong(observed):
    found = (observed["probability"] > 0.5).astype(int)
    assert not (observed["probability"] == 0.5).any()
    assert list(observed.index[found != observed["labelled"]]) == [MISHEARD]


def test_at_each_speed_the_deepest_cut_alone_chatters_and_is_the_roughest(observed):
    deepest = observed.groupby("rpm")["depth_mm"].transform("max") == observed["depth_mm"]
    assert (observed["probability"][deepest] > 0.9).all()
    assert (observed["probability"][~deepest] < 0.1).all()
    assert observed["ra_um"][deepest].min() > 2.0 * observed["ra_um"][~deepest].max()


@pytest.mark.slow
def test_label_and_frequency_are_those_of_the_simulator(observed, tmp_path):
    truth = chatter.make(tmp_path / "trimule-chatter")
    unstable = np.array(truth["unstable"])
    np.testing.assert_array_equal(observed["probability"] > 0.5, unstable)
    assert observed.index[truth["misheard"]] == MISHEARD
    away = observed["chatter_hz"] - np.array(truth["chatter_hz"], dtype=float)
    assert (away.abs() < 1.96 * observed["chatter_sd_hz"])[unstable].all()


@pytest.mark.slow
def test_the_lobes_of_the_hammer_test_separate_the_cuts(processed):
    batch = read_batch(processed)
    problem = lobes.problem(batch, lobes.observe(batch, Processed(processed), {}), {})
    np.testing.assert_array_equal(problem.probability_unstable > 0.5, problem.unstable)
