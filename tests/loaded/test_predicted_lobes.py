"""Lobes at settings of a user: one mode in closed form, probabilities, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.batch.columns import RUNS
from metro.batch.findings import ContractError
from metro.loaded.lobes import predict_lobes

KTC, KRC, STIFFNESS, DAMPING, TEETH = 900.0, 300.0, 5e6, 0.03, 4
MODES = pd.DataFrame(
    {
        "position": ["1"],
        "direction": ["x"],
        "frequency_hz": [600.0],
        "frequency_sd_hz": [0.5],
        "damping": [DAMPING],
        "damping_sd": [1e-3],
        "stiffness_n_m": [STIFFNESS],
        "stiffness_sd": [1e5],
        "mass_kg": [STIFFNESS / (2.0 * math.pi * 600.0) ** 2],
        "used": [True],
    }
)


def batch():
    row = dict.fromkeys((column.name for column in RUNS), "")
    row |= {column.name: math.nan for column in RUNS if column.numeric}
    row |= {"run": "r1", "operation": "slot", "direction": "slot", "spindle_rpm": 3000.0}
    row |= {"feed_per_tooth_mm": 0.05, "axial_depth_mm": 1.0, "feed_direction_deg": 0.0, "pose": "1"}
    coefficients = {"ktc_n_mm2": KTC, "krc_n_mm2": KRC, "kac_n_mm2": 0.0}
    coefficients |= {f"{name}_n_mm": 0.0 for name in ("kte", "kre", "kae")}
    tool = {"diameter_mm": 12.0, "teeth": TEETH, "helix_deg": 0.0}
    manifest = {"tool": tool, "coefficients": coefficients}
    return Batch("one-mode", manifest, {"cell": "bench"}, pd.DataFrame([row]).set_index("run"), {})


def lobes(entry=None, **call):
    return predict_lobes(
        batch(), MODES, {}, entry or {}, **{"position": None, "rpm": None, "run": None, **call}
    )


def test_the_lowest_depth_of_one_mode_is_that_of_the_closed_form():
    """Slot, four even teeth: constant directional factors, α_xx = −π K_r; a = 8 k ζ (1 + ζ)/(N K_rc)."""
    predicted = lobes(rpm=np.linspace(1500.0, 2500.0, 200))
    expected = 8.0 * STIFFNESS * DAMPING * (1.0 + DAMPING) / (TEETH * KRC * 1e6) * 1e3
    assert predicted.lowest_mm == pytest.approx(expected, rel=2e-3)


def test_the_probability_is_one_half_at_the_boundary_and_little_below_the_band():
    predicted = lobes(rpm=[2000.0, 2400.0])
    row = predicted.table.iloc[1]
    assert predicted.probability_stable(2400.0, row["depth_mm"]) == pytest.approx(0.5, abs=0.05)
    assert predicted.probability_stable(2400.0, row["depth_lo_mm"]) == pytest.approx(0.975, abs=0.015)
    with pytest.raises(ContractError, match="expected 2000 to 2400"):
        predicted.probability_stable(9000.0, 1.0)


def test_an_effect_found_moves_boundary_band_and_probability_together():
    softer = {
        "effects": [
            {
                "effect": "spindle_speed_softening",
                "parameters": {"change_per_krpm": {"value": -0.1, "ci95": [-0.11, -0.09]}},
            }
        ]
    }
    plain, soft = lobes(rpm=[2000.0, 2400.0]), lobes(softer, rpm=[2000.0, 2400.0])
    assert soft.effects == ("spindle_speed_softening",)
    ratio = soft.table / plain.table
    assert ratio["depth_mm"].to_numpy() == pytest.approx(ratio["depth_lo_mm"].to_numpy())
    assert (ratio["depth_mm"] - 1.0).abs().min() > 0.05
    depth = float(soft.table["depth_mm"].iloc[0])
    assert soft.probability_stable(2000.0, depth) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"position": "9"}, "has no modes; expected one of: 1"),
        ({"rpm": []}, "expected 1 to 400 speeds"),
        ({"rpm": [-1.0]}, "speeds greater than 0"),
    ],
)
def test_what_cannot_be_predicted_is_refused(call, words):
    with pytest.raises(ContractError, match=words):
        lobes(**call)


def test_the_picture_reaches_to_the_best_lobe_unless_that_has_no_end():
    from matplotlib.figure import Figure

    predicted = lobes(rpm=np.linspace(2000.0, 9500.0, 200))
    top = predicted.plot(Figure().add_subplot()).get_ylim()[1]
    assert top > predicted.table["depth_mm"].max()
    endless = replace(predicted, table=predicted.table.assign(depth_mm=np.append(np.ones(199), 1e6)))
    assert 4.0 < endless.plot(Figure().add_subplot()).get_ylim()[1] < 5.0
