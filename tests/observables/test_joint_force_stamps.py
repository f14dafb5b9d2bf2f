"""How joints turn by a log of which some packets are stamped late, and whose encoders are noisy."""

from pathlib import Path

import numpy as np
import pytest

from metro.batch.processed import Processed, read_batch
from metro.joint_columns import Axes
from metro.observables.joint_force import observable as joint_force
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
AXES = Axes((False,) * 6)


def stamped(times, rng):
    """Stamps of packets of which one in fifty comes up to four periods late, and those after it at once."""
    period = np.median(np.diff(times))
    late = (rng.uniform(size=len(times)) < 0.02) * rng.uniform(1.0, 4.0, len(times)) * period
    queued = 1e-2 * period * np.arange(len(times))
    return np.maximum.accumulate(times + late - queued) + queued


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The bundled batch of the robot's side cuts as it is ingested."""
    out = tmp_path_factory.mktemp("kr160") / "out"
    ingest(ROOT / "data" / "raw" / "kr160-side", ROOT / "config" / "cells", out, {}, "test")
    return out


class Late(Processed):
    """The tables of the folder, with packets of the robot's logs that come late."""

    def __call__(self, name, run=None):
        table = super().__call__(name, run).copy()
        if name == "robot":
            rng = np.random.default_rng(1)
            for _, rows in table.groupby(["run", "log"]):
                table.loc[rows.index, "t_s"] = stamped(rows["t_s"].to_numpy(), rng)
        return table


def test_a_packet_that_comes_late_makes_no_joint_faster(folder):
    batch = read_batch(folder)
    even, late = (
        joint_force.observe(batch, read(folder), {})["joint_torque"].groupby("run")[AXES.rates].mean()
        for read in (Processed, Late)
    )
    np.testing.assert_allclose(late, even, atol=0.01 * even.abs().to_numpy().max())


class Noisy(Processed):
    """The tables of the folder, with angles that are measured with the noise of an encoder, 5 µrad."""

    def __call__(self, name, run=None):
        table = super().__call__(name, run).copy()
        if name == "robot":
            noise = np.degrees(5e-6) * np.random.default_rng(2).normal(size=(len(table), 6))
            table[AXES.positions] += noise
        return table


def test_the_noise_of_the_encoders_is_no_way_that_friction_follows(folder):
    """Along a path on which a joint hardly moves it had added up to more than the turn of its friction."""
    batch = read_batch(folder)
    quiet, noisy = (
        joint_force.observe(batch, read(folder), {})["joint_torque"][AXES.positions].to_numpy()
        for read in (Processed, Noisy)
    )
    np.testing.assert_allclose(noisy, quiet, rtol=0.0, atol=np.degrees(1e-9))
