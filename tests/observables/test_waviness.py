"""Waviness from raw logs and traces to blocks and report, on the batch that the deformation's tests make."""

from dataclasses import replace

import numpy as np
import pytest
from test_deformation import Cell, moves

from metro.effects.periodogram import peaks
from metro.observables.arm.wall import wall
from metro.observables.problem import BaseFit, Problem
from metro.observables.waviness import observable as waviness
from metro.observables.waviness.model import Vibration, WavinessModel
from metro.observables.waviness.points import ENCODER
from metro.observables.waviness.report import joint_share
from metro.robot.amplified import AmplifiedRipple, Structure
from metro.robot.drive_torques import DriveTorques, Ripple
from metro.robot.torsion import Torsion
from metro.units import DEG, MM

JOINTS = range(1, 7)


@pytest.fixture(scope="module")
def made():
    cell = Cell(tracking=1e-4)
    observed = waviness.observe(cell.batch, cell.read, {})
    return cell, observed, waviness.problem(cell.batch, observed, {})


def test_each_wall_is_a_block_of_waves_within_the_band(made):
    _, observed, task = made
    assert isinstance(task, Problem)
    assert observed["waviness_refused"].empty
    believed, *walls = task.blocks
    assert {block.run for block in walls} == {"r1", "r2", "r3"}
    assert [block.run for block in task.role("validate")] == ["r3"]
    assert (believed.belief, believed.role, believed.measured.tolist()) == (True, "calibrate", [1.0])
    for block in walls:
        assert block.to_rows(block.measured).shape == block.coordinates["x_mm"].shape
        assert np.isfinite(block.sigma).all()


def test_a_profile_that_lies_elsewhere_along_the_log_differs_by_the_direction_of_its_zero(made):
    """What a shift of 2 µm does to the waves is 2 µm times that direction, whatever made the waves."""
    _, observed, task = made
    for block in task.role("identify", "validate"):
        points = observed["waviness_points"].groupby("run").get_group(block.run)
        x, height = points["x_mm"].to_numpy() * 1e-3, points["waviness_um"].to_numpy() * 1e-6
        moved = np.interp(x + 2e-6, x, height) - np.interp(x - 2e-6, x, height)
        seen = block.synthesis.T @ moved[points["kept"].to_numpy()] / 2
        expected = block.zeros[:, 0] * 2e-6
        assert np.linalg.norm(expected) > 0.0
        assert np.linalg.norm(seen - expected) < 1e-6 * np.linalg.norm(expected)
        assert 0.0 < block.zero_sd[0] < 0.2e-3


def test_ripples_are_what_a_model_with_the_ripple_predicts_beyond_the_one_without(made):
    task = soft(made[2])
    base, orders = task.base, np.array([90.0, 900.0])
    for block in task.role("identify"):
        _, without = base.design(block, np.zeros(0))
        for order, wave in zip(orders, base.ripples(block, 2, orders).T, strict=True):
            drives = DriveTorques(ripple=(Ripple(2, order, 3.0, -2.0),))
            _, found = replace(base, drives=drives).design(block, np.zeros(0))
            expected = 3.0 * wave.imag - 2.0 * wave.real
            assert np.linalg.norm(found - without - expected) < 1e-9 * np.linalg.norm(expected)


@pytest.mark.parametrize("tracked", [0.0, 1.0])
def test_the_strongest_lines_are_those_of_a_least_squares_fit_line_by_line(made, tracked):
    """One line of joint 3 is hidden in the walls; the peaks are those that fits of single lines have."""
    task = soft(made[2], tracked)
    runs = [block for block in task.blocks if block.role == "identify"]
    drives = DriveTorques(ripple=(Ripple(2, 420.0, 90.0, 40.0),))
    hidden = [replace(task.base, drives=drives).design(block, np.zeros(0)) for block in runs]
    seen = {b.run: m[:, 0] + offset for b, (m, offset) in zip(runs, hidden, strict=True)}
    blocks = [replace(block, measured=seen.get(block.run, block.measured)) for block in task.blocks]
    told = replace(task, blocks=tuple(blocks))
    orders = np.arange(300.0, 600.0, 2.0)
    found, size = peaks(told, lambda model, block, some: model.ripples(block, 2, some), orders, 99)
    if not tracked:  # else some of the line is taken for tracking
        assert found[0] == 420.0
        assert size[0] == pytest.approx(np.hypot(90.0, 40.0), rel=1e-6)
    power, amplitude = np.array([alone(told, order) for order in orders]).T
    around = np.pad(power, 1, constant_values=-np.inf)
    tops = [i for i in range(len(power)) if around[i] < power[i] >= around[i + 2]]
    strongest = sorted(tops, key=lambda i: -power[i])
    assert found.tolist() == orders[strongest].tolist()
    np.testing.assert_allclose(size, amplitude[strongest], rtol=1e-6)


def soft(problem, tracked=1.0):
    """Return the problem of an arm whose joints give way, with so much of its tracking error."""

    def gives_way(run):
        return replace(run, compliance=np.full(6, 1e-6), by_joint=tracked * run.by_joint)

    blocks = (b if b.belief else replace(b, setting=gives_way(b.setting)) for b in problem.blocks)
    return replace(problem, blocks=tuple(blocks))


def alone(problem, order):
    """Fit one order to what the transfer leaves: return by how much that lowers it, and the amplitude."""
    base = problem.base
    known = [block for block in problem.blocks if block.role == "identify" or block.belief]
    rows = [(base.design(block, np.zeros(0))[0][:, 0], block) for block in known]
    transfer = sum(row @ (block.measured / block.error**2) for row, block in rows)
    transfer /= sum(row @ (row / block.error**2) for row, block in rows)
    columns, target = [], []
    for row, block in rows:
        if block.role == "identify":
            wave = base.ripples(block, 2, np.array([order]))[:, 0]
            columns.append(np.column_stack([wave.imag, wave.real]) / block.error[:, None])
            target.append((block.measured - transfer * row) / block.error)
    scaled, left = np.vstack(columns), np.concatenate(target)
    best = np.linalg.lstsq(scaled, left, rcond=None)[0]
    return float(np.sum((scaled @ best) ** 2)), float(np.hypot(*best))


def test_the_report_gives_wall_and_prediction_with_intervals(made):
    cell, observed, task = made
    fit = BaseFit(np.array([1.0]), np.array([[1e-4]]), 2.0, {})
    arm = waviness.report(cell.batch, observed, {}, task, fit)["arm"]
    for found in arm["waviness"].values():
        low, high = found["wa_measured"]["ci95"]
        assert low <= found["wa_measured"]["value"] <= high
        assert found["wa_predicted"]["unit"] == "um"
        assert -1.0 <= found["correlation"]["value"] <= 1.0
        assert sum(found["joint_share"]) == pytest.approx(1.0)
        assert int(np.argmax(found["joint_share"])) == 5  # the only joint that strays


def test_a_run_without_a_direction_is_refused_with_the_reason(made):
    cell, _, _ = made
    runs = cell.batch.runs.assign(direction="slot")
    batch = type(cell.batch)("b", cell.batch.manifest, cell.batch.cell, runs, {})
    observed = waviness.observe(batch, cell.read, {})
    assert observed["waviness_refused"]["reason"].str.contains("neither up nor down").all()
    assert "waviness_points" not in observed


def test_the_noise_of_each_encoder_is_told_at_the_tip_by_its_lever():
    """White noise of 2e-6 rad on every joint: at the wall it is that times the joint's lever."""
    cell, rng = Cell(tracking=0.0), np.random.default_rng(1)
    for run, table in cell.logs.items():
        noisy = {
            f"q{i}_deg": table[f"q{i}_set_deg"] + 2e-6 * rng.normal(size=len(table)) / DEG for i in JOINTS
        }
        cell.logs[run] = table.assign(**noisy)
    facts = waviness.observe(cell.batch, cell.read, {})["waviness_runs"].set_index("run")
    for run, row in facts.iterrows():
        q = cell.logs[run][[f"q{i}_set_deg" for i in JOINTS]].to_numpy() * DEG
        levers = np.abs(wall(cell.batch, run).normal @ moves(cell.arm, q[len(q) // 4]))
        at_tip = row[[ENCODER.format(i) for i in JOINTS]].to_numpy(dtype=float) * 1e-6
        np.testing.assert_allclose(at_tip, 2e-6 * levers, rtol=0.35, atol=2e-8)


def test_shares_of_joints_are_those_of_independent_waves():
    x = np.arange(1000)
    by_joint = np.zeros((1000, 6))
    by_joint[:, 1], by_joint[:, 5] = 2.0 * np.sin(2 * np.pi * x / 100), np.sin(2 * np.pi * x / 50)
    np.testing.assert_allclose(joint_share(by_joint), [0, 0.8, 0, 0, 0, 0.2], atol=1e-12)


def test_waviness_that_the_tip_strayed_is_recognised():
    """Joint 6 strays by a wave of 3 mm, and the wall has it by the lever of that joint."""
    cell = Cell(tracking=0.0)
    for run, table in cell.logs.items():
        q = table[[f"q{i}_set_deg" for i in range(1, 7)]].to_numpy() * DEG
        s = cell.arm.tip(q)[:, 1] / MM
        wave = 2e-5 * np.sin(2 * np.pi * s / 3)
        cell.logs[run] = table.assign(q6_deg=table["q6_set_deg"] + wave / DEG)
        lever = moves(cell.arm, q[len(q) // 4])[:, 5] @ wall(cell.batch, run).normal
        x = cell.profiles[run]["x_mm"]
        cell.profiles[run]["z_mm"] += lever * 2e-5 * np.sin(2 * np.pi * x / 3) / MM
    observed = waviness.observe(cell.batch, cell.read, {})
    task = waviness.problem(cell.batch, observed, {})
    fit = BaseFit(np.array([1.0]), np.array([[1e-4]]), 2.0, {})
    found = waviness.report(cell.batch, observed, {}, task, fit)["arm"]["waviness"]["r1"]
    assert found["correlation"]["value"] > 0.95
    assert found["wa_predicted"]["value"] == pytest.approx(found["wa_measured"]["value"], rel=0.15)


def test_the_wall_shows_the_sum_of_all_that_no_encoder_sees(made):
    """What is kept of each part, as waves, adds up to the filtered sum of all at the points themselves."""
    _, _, task = made
    block = task.role("identify")[0]
    load = 300.0 * np.sin(np.outer(block.setting.t, range(1, 7)))
    run = replace(block.setting, load=load, compliance=np.full(6, 1e-6))
    ripple = AmplifiedRipple(0, 700.0, (30.0, -8.0), (5.0, 2.0), Structure(9.0, 0.06))
    drives = DriveTorques((40.0, 40.0), (0.0, 0.0, 2.0), ripple=(Ripple(2, 900.0, 60.0, -40.0),))
    torsion = Torsion(gap=(2e-5,) * 6)
    swings = (Vibration(6.0, 1e-6), Vibration(13.0, 2e-6))
    model = WavinessModel(tuple(range(6)), drives, torsion, swings, (ripple,))
    phases = np.array([0.4, 2.0])
    _, unseen = model.design(replace(block, setting=run), phases)
    torque = run.load - drives.at(run.q, run.rate, run.t)
    torque[:, 0] -= ripple.at(run.q, run.pace)
    height = (run.moves * (run.compliance * torque + torsion.passed(run.load))).sum(axis=1)
    for swing, phase in zip(swings, phases, strict=True):
        height += swing.amplitude * np.sin(2 * np.pi * swing.frequency * run.t + phase)
    np.testing.assert_allclose(unseen, run.filtered @ height, rtol=1e-9, atol=1e-15)
    for part in ("drives", "torsion", "vibration", "amplified"):
        _, without = replace(model, **{part: type(getattr(model, part))()}).design(
            replace(block, setting=run), phases
        )
        assert np.linalg.norm(without - unseen) > 1e-3 * np.linalg.norm(unseen), part
