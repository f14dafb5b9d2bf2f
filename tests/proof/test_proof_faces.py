"""How predicted faces resemble scanned ones: on a comparison written by hand, and on a simulated batch."""

import numpy as np
import pandas as pd
import pytest

from proof.faces import HIDDEN, eight_cases, figures, likenesses, tables
from proof.layout import Layout


def comparison(**shares):
    """Faces with a ridge of 100 um along x in the middle, and what a model predicts of it, by run."""
    x, y = (part.ravel() for part in np.meshgrid(np.arange(20.0), np.arange(10.0)))
    ridge = 0.1 * (np.abs(y - 4.5) < 1.0)
    frames = [
        pd.DataFrame(
            {"observable": "flatness", "run": run, "x_mm": x, "y_mm": y, "sigma": 1e-9}
            | {"measured": ridge, "before": before * ridge, "after": after * ridge}
        )
        for run, (before, after) in shares.items()
    ]
    other = frames[0].assign(observable="force", before=0.0, after=0.0)
    return pd.concat([*frames, other], ignore_index=True)


RUNS = pd.DataFrame({"condition": ["a1l", "b2t"]}, index=["r1", "r2"])


def test_similarity_is_one_less_the_difference_over_what_is_predicted():
    one, two = likenesses(comparison(r1=(0.5, 1.0), r2=(0.8, 1.25)), RUNS)
    assert (one.case, two.case) == ("a1l", "b2t")
    assert one.before == pytest.approx(0.0, abs=1e-6)
    assert one.after == pytest.approx(1.0, abs=1e-6)
    assert two.before == pytest.approx(0.75, abs=1e-6)
    assert two.after == pytest.approx(0.8, abs=1e-6)
    assert one.measured == pytest.approx(0.1, rel=1e-6)


def test_the_median_over_faces_is_demanded_of_the_loop_and_not_of_the_base_model():
    found = likenesses(comparison(r1=(0.5, 1.0), r2=(0.8, 1.01)), RUNS)
    before, after = figures(found)
    assert before.met is None
    assert before.value == pytest.approx(0.375, abs=1e-6)
    assert after.met
    assert not figures(likenesses(comparison(r1=(0.5, 0.9), r2=(0.8, 0.8)), RUNS))[1].met
    verdict = {"status": "explained", "effects": [{"effect": "spindle_tilt"}]}
    assert [row[0] for row in tables(found, verdict)[1].rows] == ["r1", "r2"]


@pytest.mark.slow
def test_the_loop_adds_what_was_hidden_and_faces_of_eight_cases_come_up_to_their_scans(tmp_path):
    found, verdict = eight_cases(Layout(tmp_path), 1, 3)
    assert {one["effect"] for one in verdict["effects"]} == set(HIDDEN)
    before, after = figures(found)
    assert len(found) == 12
    assert before.value < after.value
    assert after.met
