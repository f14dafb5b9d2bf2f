"""The cuts recommended for a simulated batch, cut in the simulator, which marches them tooth by tooth."""

import json

import numpy as np
import pytest
from closed_project import ROOT, closed_project

from virtual_cell.recipes import chatter
from virtual_cell.regeneration import Trials

DEEPER = 1.6  # no cut that is recommended at half of what is possible would be worth much


@pytest.fixture(scope="module")
def cuts(tmp_path_factory):
    project = closed_project(tmp_path_factory.mktemp("cuts"), ROOT / "data/raw/trimule-chatter")
    return json.loads((project / "reports/trimule-chatter/verdict.json").read_text())["recommended_cuts"]


def chatters(rpm, depth_mm):
    """Cut with the truth of the batch; return which cuts chattered."""
    trials = Trials(
        (chatter._MODES["x"], chatter._MODES["z"]),
        chatter._LAW,
        chatter._TEETH,
        chatter._FEED_MM * 1e-3,
        np.array(rpm),
        np.array(depth_mm) * 1e-3,
        chatter._RUNOUT_UM * 1e-6,
        chatter._RUNOUT,
        orbit=chatter._TURN,
        immersion=(-1.0, 7.0),
        entry=chatter._ENTRY,
    )
    return chatter._grows(trials).tolist()


def test_every_recommended_cut_is_stable_and_most_are_not_far_from_chatter(cuts):
    assert {cut["advice"] for cut in cuts} == {"use", "try"}
    rpm, depth = (np.array([cut[name] for cut in cuts]) for name in ("spindle_rpm", "axial_depth_mm"))
    assert chatters(rpm, depth) == [False] * len(cuts)
    assert sum(chatters(rpm, DEEPER * depth)) >= len(cuts) - 1
