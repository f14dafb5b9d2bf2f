"""A whole batch of chatter tests through ingest and the lobes: records, wrong labels, roughness."""

from pathlib import Path

import numpy as np
import pytest

from metro.batch.processed import Processed, read_batch
from metro.observables.stability import observable as lobes
from metro.stages.ingest import ingest
from virtual_cell.recipes import chatter

CELLS = Path(__file__).parents[2] / "config" / "cells"


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batch")
    truth = chatter.make(folder / "chatter-slots")
    ingest(folder / "chatter-slots", CELLS, folder / "out", {}, "")
    batch = read_batch(folder / "out")
    return batch, lobes.observe(batch, Processed(folder / "out"), {}), truth


@pytest.mark.slow
def test_the_records_tell_what_happened_and_the_labels_that_are_wrong(seen):
    batch, observed, truth = seen
    table = observed["chatter_runs"]
    told = (table["probability"] != 0.5).to_numpy()
    unstable = np.array(truth["unstable"])
    assert told.sum() >= 18
    np.testing.assert_array_equal((table["probability"] > 0.5)[told], unstable[told])
    wrong = np.flatnonzero(told & (table["labelled"].to_numpy() != unstable))
    assert list(wrong) == truth["misheard"]
    problem = lobes.problem(batch, observed, {})
    np.testing.assert_array_equal(problem.unstable[told], unstable[told])


@pytest.mark.slow
def test_unstable_cuts_are_rougher(seen):
    _, observed, truth = seen
    ra, unstable = observed["chatter_runs"]["ra_um"].to_numpy(float), np.array(truth["unstable"])
    assert np.median(ra[unstable]) > 3 * np.median(ra[~unstable])
