"""The cut on which printed coefficients were validated, against closed forms."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.batch.batch import Batch
from metro.observables.published.forces import forces, printed_coefficients

FOLDER = Path(__file__).parents[2] / "data" / "raw" / "trimule-published"
N, A, FEED, RADIUS, HELIX = 4, 0.2, 0.06, 6.0, math.radians(40)  # mm
KRC, KRE, KAC, KAE, KTC, KTE = 11036.5, 100.03, 5000.0, 214.32, 10145.0, 591.92
ORBIT = (19.05 - 12) / 2


@pytest.fixture(scope="module")
def published():
    return pd.read_csv(FOLDER / "published.csv", dtype={"table": str, "row": str})


@pytest.fixture(scope="module")
def batch():
    manifest = yaml.safe_load((FOLDER / "batch.yaml").read_text())
    runs = pd.read_csv(FOLDER / "runs.csv").set_index("run")
    runs = runs.assign(radial_depth_mm=np.nan, direction="slot", feed_direction_deg=0.0)
    return Batch("trimule-published", manifest, {"cell": "trimule"}, runs, {})


@pytest.fixture(scope="module")
def table(batch, published):
    return forces(batch, published)


def test_the_orbit_follows_from_the_feed(batch):
    row = batch.runs.iloc[0]
    assert row["orbit_rpm"] == pytest.approx(N * FEED * 2000 / (2 * math.pi * ORBIT), rel=1e-5)


def test_the_record_is_one_orbit_of_whole_revolutions_sampled_evenly(table):
    assert table["t_s"].max() == pytest.approx(60 / 21.6721, abs=0.03 / 100)
    assert np.ptp(np.diff(table["t_s"])) < 1e-12


def test_mean_thrust_is_that_of_periphery_and_bottom_edges(table):
    """Slot means per arc length of the edge, inclined by the ramp, and N R (K_Fac s_ta + K_Fae)."""
    ramp = math.atan(A / (2 * math.pi * ORBIT))
    z = N * A / math.pi * KAC * FEED + N * A / 2 * KAE / math.cos(HELIX)
    x = -(N * A / 4) * KRC * FEED - N * A / math.pi * KRE / math.cos(HELIX)
    axial_feed = A * 21.6721 / (2000 * N)
    bottom = N * RADIUS * (243.47 * axial_feed + 33.072)
    assert table["fz_n"].mean() == pytest.approx(z * math.cos(ramp) - x * math.sin(ramp) + bottom, rel=1e-4)


def test_the_force_in_the_plane_turns_with_the_orbit(table):
    turn = 2 * math.pi * 21.6721 / 60 * table["t_s"]
    y = N * A / 4 * KTC * FEED + N * A / math.pi * KTE / math.cos(HELIX)
    along_left = (-np.sin(turn) * table["fx_n"] + np.cos(turn) * table["fy_n"]).mean()
    assert along_left == pytest.approx(y, rel=1e-3)
    assert abs(table["fx_n"].mean()) < 0.01 * y


def test_without_all_eight_coefficients_or_a_helical_run_there_is_nothing(batch, published):
    assert printed_coefficients(published[published["row"] != "K_Fae"]) is None
    assert forces(batch, published[published["row"] != "K_Fae"]).empty
    empty = Batch(batch.name, batch.manifest, batch.cell, pd.DataFrame(), {})
    assert forces(empty, published).empty
