"""Which axial feeds tell K_Fac: by drawn lines, and by the line through the thrust of simulated holes."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.batch.capabilities import Stock
from metro.observables.force.bottom_edges import MAY_BE, SCATTER, advice, needed, spread, told_apart
from metro.observables.force.description import needs

PUBLISHED = [0.271e-6, 0.271e-6, 0.4515e-6, 0.4515e-6]
STEEP = [2.5e-6, 2.5e-6, 12.7e-6, 12.7e-6]


@pytest.mark.parametrize("feeds", [PUBLISHED, STEEP])
def test_the_scatter_of_a_line_through_drawn_thrusts_is_the_one_predicted(feeds):
    rng = np.random.default_rng(5)
    kfae, reach = 33.072e3, 4 * 6e-3
    thrust = reach * kfae * (1.0 + SCATTER * rng.standard_normal((4000, len(feeds))))
    slopes = np.polyfit(feeds, thrust.T, 1)[0] / reach
    assert slopes.std() / kfae == pytest.approx(SCATTER / spread(feeds), rel=0.04)


def test_two_feeds_as_far_apart_as_is_said_tell_it_and_nearer_ones_do_not():
    for runs in (4, 6, 10):
        half = runs // 2
        assert told_apart([0.0] * half + [1.01 * needed(runs)] * half)
        assert not told_apart([0.0] * half + [0.99 * needed(runs)] * half)
    assert needed(4) * MAY_BE == pytest.approx(2.0 * SCATTER)


def test_what_is_lacking_is_said_with_the_feeds_that_would_do():
    assert "0.18 µm apart and do not determine it better than is known beforehand" in advice(PUBLISHED)
    assert "at least 4.8 µm" in advice(PUBLISHED)
    nearly = [0.7 * feed for feed in (0.0, 0.0, needed(4), needed(4))]
    assert "give it ± 5.9 (beforehand: ± 8.2 times K_Fae per mm)" in advice(nearly)
    rounded = [PUBLISHED[0], PUBLISHED[0] * (1.0 + 1e-15)]  # a difference of rounding is none
    assert "0 µm apart and do not determine it" in advice(rounded)
    assert advice(STEEP) == advice([]) == ""


@pytest.mark.parametrize(("depth", "lacks"), [(0.2, True), (10.0, False)])
def test_a_run_table_is_enough_to_know_it_before_a_cut(depth, lacks):
    runs = pd.DataFrame(
        {
            "operation": "helical",
            "role": "identify",
            "dynamometer": "a.csv",
            "axial_depth_mm": depth,
            "orbit_rpm": [10.84, 10.84, 18.06, 18.06],
            "spindle_rpm": 2000.0,
            "feed_per_tooth_mm": 0.03,
            "radial_depth_mm": 12.0,
            "direction": "slot",
        }
    )
    manifest = {"tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 40}}
    (force,) = needs(Stock(manifest, {}, runs, {}))
    assert any("K_Fac" in wish for wish in force.missing) == lacks


def test_the_bundled_holes_tell_k_fac_within_its_interval(tmp_path):
    from test_round_trip import TABLE_4, identified

    raw = Path(__file__).parents[2] / "data" / "raw" / "trimule-bottom"
    found = identified(raw, tmp_path / "out")["kfac"]
    low, high = found["ci95"]
    assert low < TABLE_4["kfac"] < high
    assert high - low < TABLE_4["kfac"]
