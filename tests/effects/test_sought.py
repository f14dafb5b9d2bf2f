"""Lines that are looked for among many: how many independent ones there were, on walls made of a formula."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from metro.effects import gear_ripple, path_vibration
from metro.observables.problem import Block, Parameter, Problem, Refusal
from metro.observables.waviness.model import Vibration
from metro.robot.drive_torques import DriveTorques

RATE, SECONDS, FREQUENCY, SIZE = 100.0, (8.0, 6.0), 7.3, 4e-6

NO_TORQUE = DriveTorques()
TURN_RATE, MICROMETRE_PER_NM = 0.3, 1e-6


@dataclass(frozen=True)
class Setting:
    t: np.ndarray

    @property
    def filtered(self):
        """No filter."""
        return np.eye(len(self.t))

    @property
    def q(self):
        """Angles of the joints: the second turns steadily."""
        return np.outer(TURN_RATE * self.t, np.eye(6)[1])


@dataclass(frozen=True)
class Wall:
    """A constant, the tip's vibration in time, and what the torque of a joint does."""

    vibration: tuple[Vibration, ...] = ()
    drives: DriveTorques = NO_TORQUE
    parameters: tuple = (Parameter("level", "um", 1e-6),)

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, block, _nuisance, _beta=None):
        setting = block.setting
        torque = self.drives.at(setting.q, 0.0 * setting.q, setting.t)[:, 1]
        swings = sum(swing.at(setting.t, 0.0) for swing in self.vibration)
        return np.ones((len(setting.t), 1)), swings + MICROMETRE_PER_NM * torque

    def ripples(self, block, joint, orders):
        """Ripples of 1 N m, as complex amplitudes of a cosine; of the second joint alone."""
        return (joint == 1) * MICROMETRE_PER_NM * np.exp(1j * np.outer(block.setting.q[:, joint], orders))


def wall(run, seconds):
    t = np.arange(round(seconds * RATE)) / RATE
    rng = np.random.default_rng(int(seconds))
    measured = SIZE * np.sin(2 * np.pi * FREQUENCY * t + 0.4) + 1e-6 * rng.normal(size=t.size)
    return Block(
        run=run, condition=run, role="identify", order=1, measured=measured, sigma=np.full(t.size, 1e-6),
        setting=Setting(t), axis=np.full(t.size, "n"), zeros=np.zeros((t.size, 0)), zero_sd=np.zeros(0),
        coordinates={},
    )  # fmt: skip


@pytest.fixture(scope="module")
def task():
    blocks = tuple(wall(f"r{seconds:g}", seconds) for seconds in SECONDS)
    return Problem("waviness", "um", 1e-6, Wall(), blocks, np.full(1, 0.01))


def test_a_vibration_is_one_of_as_many_lines_as_the_longest_run_resolves(task):
    found = path_vibration.adapt(path_vibration.ON_WALLS, task)
    frequency, amplitude = found.parameters
    assert found.own == 1
    assert frequency.starts[0] == pytest.approx(FREQUENCY, abs=0.5 / max(SECONDS))
    assert amplitude.starts[0] > 0.0
    # from two cycles of the shortest run to four points a cycle, each line as wide as 1 / (8 s)
    lines = (RATE / 4 - 2 / min(SECONDS)) * max(SECONDS)
    assert found.sought == pytest.approx(lines, rel=0.02)
    assert found.odds == pytest.approx(1 / lines, rel=0.02)


def test_a_ripple_is_one_of_as_many_lines_as_the_longest_turn_resolves(task):
    """The same wave by the angle: 7.3 Hz at 0.3 rad/s is of order 153."""
    found = gear_ripple.EFFECT[1].adapt(gear_ripple.EFFECT[1], task)
    span = TURN_RATE * max(SECONDS)
    assert found.parameters[1].starts[0] == pytest.approx(2 * np.pi * FREQUENCY / TURN_RATE, abs=np.pi / span)
    lines = (RATE / 4 * 2 * np.pi / TURN_RATE - 2 * 2 * np.pi / span) * span / (2 * np.pi)
    assert found.sought == pytest.approx(lines, rel=0.02)
    assert isinstance(gear_ripple.EFFECT[0].adapt(gear_ripple.EFFECT[0], task), Refusal)  # it does not turn


def test_the_first_line_is_the_one_that_stands_out_of_the_noise_told_by_block(task):
    """An error that all repeats share counts as one of the run: a block that is not known has no say."""
    first, second = task.blocks
    loud = replace(second, measured=second.measured + 1e-4 * np.sin(19 * second.setting.t))
    unknown = replace(loud, alike=np.full(loud.sigma.shape, 1e-2))
    assert unknown.error == pytest.approx(np.hypot(1e-6, 1e-2))
    mixed = replace(task, blocks=(first, unknown))
    found = path_vibration.adapt(path_vibration.ON_WALLS, mixed)
    assert found.parameters[0].starts[0] == pytest.approx(FREQUENCY, abs=0.5 / max(SECONDS))


def test_lines_whose_torques_are_far_apart_start_from_their_own(task):
    """A quick line of a small torque among slow ones of ten times as much: their median would hide it."""
    assert gear_ripple._apart(np.array([7.9, 130.0, 120.0, 25.0, 9.0])) == (7.9, 25.0, 120.0)
    assert gear_ripple._apart(np.array([30.0, 31.0])) == (30.0,)
    torque, order, _ = gear_ripple.EFFECT[1].adapt(gear_ripple.EFFECT[1], task).parameters
    assert len(torque.starts) >= 1
    assert max(torque.starts) <= torque.upper
    assert order.starts
