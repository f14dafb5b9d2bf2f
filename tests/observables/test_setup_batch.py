"""What a cell is set up with, on the bundled batch: link masses, struck tip, calibration, encoders' line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from metro.batch.processed import Processed, read_batch
from metro.observables.arm.calibration import calibration
from metro.observables.arm.link_mass import link_masses
from metro.observables.arm.robot_tables import robot_tables
from metro.observables.flatness.dynamics import tip_block
from metro.observables.flatness.observable import struck_damping
from metro.observables.flatness.struck import response, struck_tables, tip_receptance
from metro.observables.stability.modal_test import observe_modes
from metro.stages.ingest import ingest
from virtual_cell.hammer import acceleration
from virtual_cell.modes import Modes
from virtual_cell.recipes import irb6640_setup as recipe

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    out = tmp_path_factory.mktemp("setup")
    ingest(ROOT / "data/raw/irb6640-setup", ROOT / "config/cells", out, {}, "test")
    return read_batch(out), Processed(out)


@pytest.fixture(scope="module")
def modal(cell):
    batch, read = cell
    return observe_modes(read, batch.instrument("hammer"))


def test_the_kinetic_energy_of_the_links_is_the_mass_that_the_simulator_computed(cell):
    table = link_masses(*cell, {})["tip_mass"].set_index(["pose", "way"])
    for pose in "AB":
        assert table.loc[(pose, "links, static"), "difference_percent"] < 1e-5
        assert table.loc[(pose, "equation 4"), "difference_percent"] > 50.0


def test_without_the_stiffness_of_the_joints_the_mass_is_the_least_that_the_tip_can_have(cell):
    batch, read = cell
    soft = {key: value for key, value in batch.cell.items() if key != "joint_stiffness_nm_rad"}
    table = link_masses(replace(batch, cell=soft), read, {})["tip_mass"].set_index(["pose", "way"])
    diagonal = ["mxx", "myy", "mzz"]
    for pose in "AB":
        least, declared = (
            table.loc[(pose, way), diagonal].to_numpy(float) for way in ("links, least", "declared")
        )
        assert (least < declared).all()
    assert link_masses(replace(batch, cell={"cell": "irb6640"}), read, {}) == {}


def test_a0_and_a1_are_identified_within_their_intervals(cell, modal):
    loads, mass = (cell[1](name) for name in ("loads", "mass"))
    block = tip_block(struck_damping({"face_loads": loads, "face_mass": mass, "modes": modal.modes}))["tip"]
    for name, truth in zip(("a0", "a1"), recipe.DAMPING["A"], strict=True):
        low, high = block[name]["ci95"]
        assert abs(block[name]["value"] - truth) < high - low
        assert set(block["poses"]) == {"A", "B"}
    assert block["a1"]["ci95"][1] - block["a1"]["ci95"][0] < 0.2 * block["a1"]["value"]


def test_m_c_and_k_give_the_measured_receptance_and_ring_down(cell, modal):
    tables = struck_tables(cell[1], modal.modes, modal.used)
    assert set(zip(tables["tip_receptance"]["position"], tables["tip_receptance"]["axis"], strict=True)) == {
        (pose, axis) for pose in "AB" for axis in "xyz"
    }
    assert tables["tip_receptance"]["difference_percent"].max() < 10.0
    ringing = tables["tip_ringing"]
    early = ringing[(ringing["since_s"] > 0.05) & (ringing["since_s"] < 0.3)]
    for _, part in early.groupby(["position", "axis"]):
        assert np.corrcoef(part["measured_m_s2"], part["model_m_s2"])[0, 1] > 0.9


def test_the_ring_down_is_that_of_the_simulator_s_oscillators():
    mass = np.array([[430.0, -8.0, -255.0], [-8.0, 167.0, 19.0], [-255.0, 19.0, 290.0]])
    stiffness = np.array([[2.2e6, 1e5, -9e5], [1e5, 7e5, 8e4], [-9e5, 8e4, 1.3e6]])
    damping = 0.92 * mass + 0.0021 * stiffness
    squares, shapes = eigh(stiffness, mass)
    omega = np.sqrt(squares)
    ratio = 0.46 / omega + 0.00105 * omega
    modes = Modes(omega * np.sqrt(1 - ratio**2) / (2 * np.pi), ratio, squares / shapes[2] ** 2)
    step, blow = 1 / 4096, np.zeros(4096 * 8)
    blow[100:140] = 300.0 * np.sin(np.pi * np.arange(40) / 40)
    found = response((mass, damping, stiffness), 2, blow, step)
    # the simulator holds the force over each step: its mean over the step, then
    expected = acceleration(modes, 0.5 * (blow + np.roll(blow, -1)), step)
    after = slice(200, None)
    assert np.abs(found - expected)[after].max() < 0.002 * np.abs(expected)[after].max()


def test_a_receptance_at_rest_is_the_compliance():
    stiffness = np.diag([1e6, 2e6, 4e6])
    found = tip_receptance(400.0 * np.eye(3), np.zeros((3, 3)), stiffness, np.zeros(1))
    assert np.allclose(found[0], np.linalg.inv(stiffness))


def test_tool_work_and_payload_are_those_that_the_touches_were_made_with(cell):
    block = calibration(*cell)["calibration"]
    truths = {
        **{("tool", axis): value for axis, value in zip("xyz", recipe.ARM.tip * 1e3, strict=True)},
        **{("work", axis): value for axis, value in zip("xyz", recipe.ORIGIN_MM, strict=True)},
        **{("work", angle): 0.0 for angle in ("rx", "ry", "rz")},
    }
    found = {key: block[key[0]][key[1]] for key in truths}
    found |= {("mass",): block["payload"]["mass"]}
    found |= {("centre", axis): block["payload"]["centre"][axis] for axis in "xyz"}
    truths |= {
        ("mass",): recipe.HEAD[0],
        **{("centre", a): v for a, v in zip("xyz", recipe.HEAD[1], strict=True)},
    }
    for key, truth in truths.items():
        low, high = found[key]["ci95"]
        assert abs(found[key]["value"] - truth) < high - low, key
    assert "inertia" not in block["payload"]
    assert json.dumps(block)


def test_a_batch_that_touched_too_little_says_what_is_lacking(cell):
    batch, read = cell

    def fewer(name, run=None):
        table = read(name, run)
        return table[table["touched"] != "tertiary"] if name == "touches" else table.iloc[:0]

    missing = calibration(batch, fewer)["calibration"]["not_identified"]
    assert "1 points of face tertiary" in missing["tool and work"]


def test_the_spectrum_of_the_path_error_has_one_line_at_the_frequency_of_the_swing(cell):
    lines = robot_tables(*cell, {}, None)["robot_lines"]
    along_y = lines[(lines["domain"] == "time") & (lines["axis"] == "y")]
    assert len(along_y) == 1
    line = along_y.iloc[0]
    assert line["frequency"] == pytest.approx(recipe.SWING_HZ, abs=3 * line["frequency_sd"])
    assert line["frequency_sd"] < 0.002
    # the first joint swings, so that the way of the tip grows with its distance from the base along the pass
    assert recipe.SWING_MM * 1e3 < line["amplitude_um"] < 1.4 * recipe.SWING_MM * 1e3
    assert lines[lines["axis"] == "z"].empty
