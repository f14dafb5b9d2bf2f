"""Forces at new settings: against the simulator, against the pipeline's own prediction, and in the limits."""

import math

import numpy as np
import pytest

from metro.batch.findings import ContractError
from virtual_cell.chips import Engagement, Tool
from virtual_cell.milling import Cut, forces
from virtual_cell.motion import Straight
from virtual_cell.recipes.slot import ALUMINIUM

AXES = ("x", "y", "z")
REVOLUTIONS = 6


def simulated(rpm, feed, depth, radial, side):
    """Force of the simulator (3, 360), N, over the last of some revolutions in full cut, no scatter."""
    tool = Tool(6e-3, math.radians(30.0), np.radians([0.0, 120.0, 240.0]))
    spindle = rpm * 2.0 * math.pi / 60.0
    motion = Straight(feed * 3 * rpm / 60.0, 0.1, side=side, edge=6e-3 - radial)
    t = np.arange(REVOLUTIONS * 360) * (2.0 * math.pi / 360.0) / spindle
    force = forces(Cut(Engagement(tool, motion, spindle, 0.0, depth), ALUMINIUM), t)
    return force[-360:].T


def predicted(table):
    return table[[f"f{axis}_n" for axis in AXES]].to_numpy().T


NEW = [
    ("side", "up", 5000.0, 0.07, 3.0, 3.0),
    ("side", "down", 6000.0, 0.10, 1.0, 2.0),
    ("slot", "slot", 6000.0, 0.10, 1.5, 12.0),
]


@pytest.mark.parametrize("cut", NEW, ids=lambda cut: f"{cut[0]}-{cut[1]}")
def test_the_interval_holds_the_force_that_the_simulator_has(loaded, cut):
    operation, direction, rpm, feed, depth, radial = cut
    force = loaded.force(
        operation=operation,
        direction=direction,
        spindle_rpm=rpm,
        feed_per_tooth_mm=feed,
        axial_depth_mm=depth,
        radial_depth_mm=radial,
    )
    true = simulated(rpm, feed / 1e3, depth / 1e3, radial / 1e3, direction)
    table = force.table
    scale = np.sqrt(np.mean(true**2))
    half = np.array([0.5 * (table[f"f{axis}_hi_n"] - table[f"f{axis}_lo_n"]) for axis in AXES])
    assert np.sqrt(np.mean(((predicted(table) - true) / half) ** 2)) < 0.9
    for axis, name in zip(true, AXES, strict=True):
        assert abs(table[f"f{name}_n"].mean() - axis.mean()) < 0.01 * scale
        inside = (table[f"f{name}_lo_n"] <= axis) & (axis <= table[f"f{name}_hi_n"])
        assert inside.mean() > 0.9


def test_the_interval_is_no_wider_than_the_scatter_of_runs_makes_it(loaded):
    table = loaded.force(run="r07").table
    half = 0.5 * (table["fx_hi_n"] - table["fx_lo_n"])
    scale = np.sqrt(np.mean(predicted(table) ** 2))
    assert 0.01 < half.mean() / scale < 0.06  # coefficients scatter by 1 % from run to run


def test_a_held_out_run_is_predicted_as_the_pipeline_did(loaded):
    rows = loaded.comparison
    rows = rows[(rows["observable"] == "force") & (rows["run"] == "r07")]
    rows = rows[rows["t_s"] == rows["t_s"].iloc[0]].sort_values("angle_deg")
    theirs = np.array([rows[rows["axis"] == axis]["after"] for axis in AXES])
    orders = np.fft.rfft(predicted(loaded.force(run="r07").table))[:, :25] / 360.0
    shift = np.exp(1j * np.outer(np.arange(25), np.linspace(0.0, 2.0 * math.pi, 7200)))
    ours = np.fft.rfft(theirs)[:, :25] / 120.0
    left = np.sqrt(
        2.0 * (np.abs(orders[..., None] * shift - ours[..., None]) ** 2).sum(axis=(0, 1)).min() / 3.0
    )
    assert left < 2e-3 * np.sqrt(np.mean(theirs**2))


def test_the_mean_force_of_a_slot_is_that_of_the_closed_form(loaded):
    """Altintas, Manufacturing Automation, eq. 2.42: F_x = −N a (K_rc c/4 + K_re/π), likewise the others."""
    ktc, krc, kac, kte, kre, kae = (
        float(loaded.quantity(f"force.waveform.{name}"))
        for name in ("ktc", "krc", "kac", "kte", "kre", "kae")
    )
    force = loaded.force(operation="slot", feed_per_tooth_mm=0.02, axial_depth_mm=1.2, radial_depth_mm=12.0)
    area, length = 3 * 1.2 * 0.02, 3 * 1.2
    assert force.mean_n["x"] == pytest.approx(-area * krc / 4 - length * kre / math.pi, rel=2e-3)
    assert force.mean_n["y"] == pytest.approx(area * ktc / 4 + length * kte / math.pi, rel=2e-3)
    assert force.mean_n["z"] == pytest.approx(area * kac / math.pi + length * kae / 2.0, rel=2e-3)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"feed_mm": 0.1}, "is no setting of a cut"),
        ({"axial_depth_mm": -1.0}, "found -1.0"),
        ({"direction": "sideways"}, "found 'sideways'"),
        ({"run": "r99"}, "no such run"),
        ({"operation": "side", "direction": "up", "radial_depth_mm": 40.0}, "radial depth"),
    ],
)
def test_a_cut_that_cannot_be_is_refused_with_what_was_found(loaded, settings, words):
    with pytest.raises(ContractError, match=words):
        loaded.force(**settings)
