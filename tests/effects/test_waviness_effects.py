"""What waviness tells of friction, gaps and vibration: each found where it is, and nothing where not."""

from dataclasses import replace

import numpy as np
import pytest
from wavy import GATES, problem

from metro.effects.library import library
from metro.effects.path_vibration import ON_WALLS as VIBRATION
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.search import search
from metro.loop.verdict.verdict import parameters
from metro.observables.waviness.blocks import FOLLOWS, believed_block
from metro.observables.waviness.model import Vibration, WavinessModel
from metro.robot.amplified import AmplifiedRipple, Structure
from metro.robot.drive_torques import DriveTorques, Ripple
from metro.robot.torsion import Torsion

MDEG = np.pi / 180e3
STEPS = tuple(e for e in library("waviness") if e.name in {"friction_reversal", "joint_backlash"})
LIBRARY = (*(e for e in STEPS if e.form in {"joint 4", "joint 5"}), VIBRATION)


def test_nothing_is_found_where_the_wall_follows_the_tip():
    assert search(problem(seed=0), LIBRARY, GATES).names == ()


def test_the_transfer_is_found():
    outcome = search(problem(transfer=0.8, seed=5), (), GATES)
    assert outcome.names == ()
    assert outcome.final.beta[0] == pytest.approx(0.8, abs=0.03)


def test_more_friction_is_found_in_the_joint_that_turns_round():
    torque = -40.0
    truth = WavinessModel(tuple(range(6)), drives=DriveTorques().with_friction(3, reversal=torque))
    outcome = search(problem(truth, seed=1), LIBRARY, GATES)
    assert [(e.name, e.form) for e in outcome.final.candidate.effects] == [("friction_reversal", "joint 4")]
    found = parameters(outcome.final, "friction_reversal")["torque_nm"]
    assert found["ci95"][0] < torque < found["ci95"][1]
    assert found["value"] == pytest.approx(torque, rel=0.15)


def test_friction_of_a_joint_that_turns_one_way_makes_no_waves():
    blocks = problem(seed=1).role("identify")
    friction = WavinessModel(tuple(range(6)), drives=DriveTorques().with_friction(5, reversal=30.0))
    for block in blocks:
        waves = (
            friction.design(block, np.zeros(0))[1]
            - WavinessModel(tuple(range(6))).design(block, np.zeros(0))[1]
        )
        assert np.abs(waves).max() < 0.2 * block.sigma[0]


def test_a_gap_is_found_where_the_torque_of_its_joint_changes_sign():
    truth = WavinessModel(tuple(range(6)), torsion=Torsion().with_joint(4, gap=6.0 * MDEG))
    outcome = search(problem(truth, seed=2), LIBRARY, GATES)
    assert [(e.name, e.form) for e in outcome.final.candidate.effects] == [("joint_backlash", "joint 5")]
    found = parameters(outcome.final, "joint_backlash")["angle_mdeg"]
    assert found["value"] == pytest.approx(6.0, rel=0.15)


def test_a_vibration_is_found_by_its_frequency_in_time_whatever_its_phase_in_each_run():
    frequency, amplitude = 8.7, 0.8
    truth = WavinessModel(tuple(range(6)), vibration=(Vibration(frequency, amplitude * 1e-6),))
    outcome = search(problem(truth, seed=3), LIBRARY, GATES)
    assert outcome.names == ("path_vibration",)
    found = parameters(outcome.final, "path_vibration")
    assert found["frequency_hz"]["value"] == pytest.approx(frequency, abs=0.03)
    assert found["amplitude_um"]["ci95"][0] < amplitude < found["amplitude_um"]["ci95"][1]
    assert found["amplitude_um"]["value"] == pytest.approx(amplitude, rel=0.2)


def test_no_run_follows_the_tip_by_another_share_than_is_believed():
    task = problem(seed=8)
    blocks = tuple(
        replace(block, measured=block.measured * (4.0 if number % 2 else -2.0))
        for number, block in enumerate(task.role("identify"))
    )
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    assert fit(Candidate(task.base), blocks, prior).noise.scatter[0] > FOLLOWS
    assert fit(Candidate(task.base), (believed_block(), *blocks), prior).noise.scatter[0] <= FOLLOWS


RIPPLES = tuple(
    e for e in library("waviness") if e.name == "gear_ripple" and e.form.startswith(("joint 1", "joint 2"))
)


def test_a_ripple_is_found_that_grows_with_the_feed_and_has_half_of_its_length_in_it():
    """At three feeds its frequency is 4.8, 6.7 and 9.5 Hz on the first path, twice that in the last case."""
    order, mode = 3000.0, Structure(11.0, 0.08)
    made = AmplifiedRipple(0, order, (30.0, 20.0), (-6.0, 9.0), mode)
    outcome = search(problem(WavinessModel(tuple(range(6)), amplified=(made,)), seed=6), RIPPLES, GATES)
    assert [(e.name, e.form) for e in outcome.final.candidate.effects] == [
        ("gear_ripple", "joint 1, amplified")
    ]
    found = parameters(outcome.final, "gear_ripple")
    assert found["order"]["value"] == pytest.approx(order, abs=1.0)
    assert found["torque_nm"]["value"] == pytest.approx(np.hypot(30.0, 20.0), rel=0.05)
    assert found["mode_hz"]["value"] == pytest.approx(mode.frequency, rel=0.02)
    assert found["mode_damping"]["value"] == pytest.approx(mode.damping, abs=0.02)
    doubled = (found["double_sine_nm"]["value"], found["double_cosine_nm"]["value"])
    assert doubled == pytest.approx((-6.0, 9.0), abs=1.5)


def test_a_ripple_of_a_stiff_arm_is_one_without_a_mode():
    truth = WavinessModel(tuple(range(6)), drives=DriveTorques(ripple=(Ripple(0, 2000.0, 25.0, 10.0),)))
    outcome = search(problem(truth, seed=7), RIPPLES, GATES)
    assert [(e.name, e.form) for e in outcome.final.candidate.effects] == [("gear_ripple", "joint 1")]


def test_waves_of_the_same_length_at_every_feed_are_no_vibration():
    """A wave along the wall, whatever the feed: its frequency in time differs from run to run."""
    task = problem(seed=4)
    wave = 2e-6 * np.sin(2 * np.pi * 400.0 * np.arange(0.0, 0.06, 0.2e-3))
    blocks = tuple(
        replace(block, measured=block.measured + block.setting.filtered @ wave) for block in task.blocks
    )
    outcome = search(replace(task, blocks=blocks), LIBRARY, GATES)
    assert outcome.names == ()
    assert outcome.lines


def test_a_vibration_belongs_to_the_time_where_runs_have_several_speeds():
    task = problem(seed=3)
    assert VIBRATION.adapt(VIBRATION, task).timed
    first = task.role("identify")[0]
    alike = replace(task, blocks=tuple(replace(first, run=f"r{i}") for i in range(3)))
    assert not VIBRATION.adapt(VIBRATION, alike).timed
