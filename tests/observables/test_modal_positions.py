"""The bundled modal test at two of its seven positions, against the modes that it was simulated with."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.observables.stability.modal_test import observe_modes
from metro.observables.stability.pickups import pickups
from metro.observables.stability.tracks import track
from virtual_cell.hybrid import modes_at
from virtual_cell.recipes.trimule import MODES
from virtual_cell.recipes.trimule_structure import SEVEN

RAW = Path(__file__).resolve().parents[2] / "data" / "raw" / "trimule-helical"
TWO = ("4", "5")
KEYS = ["test", "position", "reference", "response", "replicate"]


@pytest.fixture(scope="module")
def tested():
    impacts = pd.read_csv(RAW / "impacts.csv", dtype={"position": str})
    impacts = impacts[impacts["position"].isin(TWO)]
    parts = []
    for _, row in impacts.iterrows():
        name, _, record = row["file"].partition("#")
        blow = pd.read_parquet(RAW / name, columns=["t_s", "force_n", f"response_{record}"]).astype(float)
        blow = blow.rename(columns={f"response_{record}": "response_si"})
        parts.append(blow.assign(**row[KEYS], response_unit="m/s2"))
    frf = pd.DataFrame(columns=[*KEYS, "frequency_hz", "real_m_n", "imag_m_n"])
    hit = pd.concat(parts, ignore_index=True)
    return observe_modes(lambda name: {"hit": hit, "frf": frf}[name], {}), impacts


def test_the_modes_of_both_positions_are_those_that_were_simulated_within_their_intervals(tested):
    modes, away = tested[0].modes, []
    for position in TWO:
        true = modes_at(np.array(SEVEN[position]), MODES, np.array(SEVEN["1"]))
        for direction, one in true.items():
            found = modes[(modes["position"] == position) & (modes["direction"] == direction)]
            assert len(found) == 4
            pairs = (
                ("frequency_hz", "frequency_sd_hz", one.omega / (2 * np.pi)),
                ("damping", "damping_sd", one.damping),
                ("stiffness_n_m", "stiffness_sd", one.stiffness),
            )
            away += [(found[value] - expected) / found[sd] for value, sd, expected in pairs]
    assert np.abs(away).max() < 4.0
    assert np.mean(np.abs(away) < 1.96) > 0.8


def test_each_mode_is_followed_from_one_position_to_the_other(tested):
    where = {name: 1e-3 * np.array(SEVEN[name]) for name in TWO}
    found = track(tested[0].modes, tested[0].shapes, where)
    names = found.groupby(["position", "direction"])["mode"].agg(list)
    for direction in "xz":
        assert names["4", direction] == names["5", direction] == [f"{direction}{i}" for i in range(1, 5)]
    assert found.loc[found["position"] == "5", "mac"].min() > 0.9


def test_what_the_modes_leave_is_the_scatter_of_the_hits(tested):
    test, impacts = tested
    distances = impacts[["position", "reference", "response", "distance_mm"]].drop_duplicates()
    found = pickups(test.used, distances)
    assert found["distance_mm"].notna().all()
    # The scatter of five hits is known to 1/sqrt(8) where all lines err alike: within three of that.
    ratio = found["error"] / found["noise"]
    assert ratio.median() == pytest.approx(1.0, abs=0.25)
    assert (np.abs(ratio - 1.0) < 3.0 / np.sqrt(8.0)).all()
