"""A finished batch of the virtual cell, and records of further runs that its machine cuts afterwards."""

import shutil

import numpy as np
import pandas as pd
import pytest
from closed_project import ROOT, closed_project, without_effects

from metro.watch.arrivals import Arrivals
from metro.watch.watcher import Watcher
from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.recipes.slot import ALUMINIUM
from virtual_cell.session import Session, record_run
from virtual_cell.units import DEG, MM, UM

NAME = "clean-slot"
TOOL = (6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG)


def sensor():
    return Dynamometer(10000.0, "work", np.eye(3), noise=1.0)


@pytest.fixture(scope="session")
def finished_project(tmp_path_factory):
    """Return a project in which clean-slot has been through the fits; not to be changed."""
    root = closed_project(tmp_path_factory.mktemp("watched"), ROOT / "data/raw" / NAME, closing=False)
    without_effects(root, NAME)
    return root


class Place:
    """A project that is a test's own: its raw folder, and what comes after a cut."""

    def __init__(self, root, made):
        self.root, self.made = root, made
        self.raw, self.reports = root / "data/raw" / NAME, root / "reports" / NAME
        self.clock = 0.0

    def plan(self, run, plan, file=None, **settings):
        """Append a row for a planned run to runs.csv."""
        table = pd.read_csv(self.raw / "runs.csv", dtype={"run": str})
        row = {
            "run": run,
            "operation": plan.operation,
            "direction": plan.direction,
            "order": len(table) + 1,
            "dynamometer": file or f"force/{run}.parquet",
        }
        numbers = ("spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm", "cut_length_mm")
        row |= {name: getattr(plan, name) for name in numbers} | {"feed_direction_deg": 0} | settings
        pd.concat([table, pd.DataFrame([row])]).to_csv(self.raw / "runs.csv", index=False)

    def record(self, run, plan, *, seed=1, runout_um=0.0, **session):
        """Cut and record a run of the virtual cell, outside of the batch; return the table of the record."""
        tool = Tool(*TOOL, runout_um * UM, 70.0 * DEG)
        true = {"coefficients": ALUMINIUM, "scatter": 0.0} | session
        now = Session(tool, true.pop("coefficients"), sensor(), **true)
        folder = self.made / run
        (folder / "force").mkdir(parents=True, exist_ok=True)
        file = record_run(now, plan, folder, run, metres=1.0, rng=np.random.default_rng(seed))
        return pd.read_parquet(folder / file)

    def drop(self, run, table):
        """Put a record into the batch."""
        table.to_parquet(self.raw / f"force/{run}.parquet")

    def watcher(self):
        """Watch with a clock that a test turns."""
        processed = self.root / "data/processed" / NAME
        return Watcher(self.raw, processed, self.reports, Arrivals(lambda: self.clock))

    def later(self, watcher, seconds=2.0):
        """Look, let time pass and look again, twice: a table and a file that it names settle one by one."""
        said = list(watcher.look())
        for _ in range(2):
            self.clock += seconds
            said += watcher.look()
        return said


@pytest.fixture
def place(finished_project, tmp_path):
    """Return a copy of the finished project."""
    root = tmp_path / "project"
    (root / "data/raw").mkdir(parents=True)
    shutil.copytree(ROOT / "data/raw" / NAME, root / "data/raw" / NAME)
    shutil.copytree(finished_project / "reports", root / "reports")
    (root / "data/processed").symlink_to(finished_project / "data/processed")
    return Place(root, tmp_path / "made")
