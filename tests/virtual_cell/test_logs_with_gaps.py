"""Robot logs that lost samples, from the raw files to the force on the tip: as from the whole logs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from test_arm_batches import made

from metro.stages.identify import identify
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
CODE = "0" * 64
FORCE, SD = ["fx_n", "fy_n", "fz_n"], ["sd_fx_n", "sd_fy_n", "sd_fz_n"]


def without_dynamometer(folder):
    """Leave the joint torques as the only thing that tells the force."""
    runs = pd.read_csv(folder / "runs.csv")
    runs.assign(dynamometer="").to_csv(folder / "runs.csv", index=False)
    manifest = yaml.safe_load((folder / "batch.yaml").read_text())
    del manifest["instruments"]["dynamometer"]
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest, sort_keys=False))


def lose(folder, rng, holes=6, longest=40):
    """Take stretches of samples, half a second and less, out of every log."""
    for path in sorted((folder / "robot").glob("*.parquet")):
        log = pd.read_parquet(path)
        kept = np.ones(len(log), bool)
        for start in rng.choice(len(log) - longest - 2, holes, replace=False) + 1:
            kept[start : start + rng.integers(longest // 2, longest)] = False
        log[kept].to_parquet(path)


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """Return the quality, the joints and the force of the whole logs and of those with gaps."""
    found = {}
    for name in ("whole", "gaps"):
        at = tmp_path_factory.mktemp(name)
        batch, _ = made(at / "one", {})
        force = {run: batch.force(run, 0.4, 0.6) for run in batch.runs.index}
        without_dynamometer(at / "one")
        if name == "gaps":
            lose(at / "one", np.random.default_rng(0))
        ingest(at / "one", ROOT / "config/cells", at / "out", {}, CODE)
        identify(at / "out", {"model_form_budget": 0.007}, CODE)
        names = ("qc", "observability", "tip_force")
        found[name] = {table: pd.read_parquet(at / f"out/{table}.parquet") for table in names}
    return found | {"true": force}


def test_the_gaps_are_said(tables):
    said = [table["qc"].query("check == 'gaps' and not ok") for table in (tables["whole"], tables["gaps"])]
    assert [len(rows) for rows in said] == [0, 4]


def test_noise_and_drift_of_the_torques_are_those_of_the_whole_logs(tables):
    """By closed forms, the noise of a joint was 37 N m instead of 2.3, and its drift 3 times too large.

    A walk of n steps that is smaller than about five times the noise over n is not told from none (Stock &
    Watson 1998), and the logs with gaps have stretches of 40 bins.
    """
    whole, gaps = (tables[name]["observability"] for name in ("whole", "gaps"))
    assert len(whole) == 12
    np.testing.assert_allclose(gaps["noise_nm"], whole["noise_nm"], rtol=0.25)
    unseen = 5.0 * whole["noise_nm"] / 40
    assert (abs(gaps["drift_nm"] - whole["drift_nm"]) < 0.6 * whole["drift_nm"] + unseen).all()
    assert (unseen < 0.35).all()


def test_the_force_on_the_tip_is_within_its_interval_across_the_gaps(tables):
    course = tables["gaps"]["tip_force"]
    assert np.diff(course["s_mm"]).max() > 2.5
    for run, part in course.groupby("run"):
        middle = part[part["x_mm"].between(0.3 * part["x_mm"].max(), 0.7 * part["x_mm"].max())]
        error = (middle[FORCE].to_numpy() - tables["true"][run]) / middle[SD].to_numpy()
        assert np.sqrt((error**2).mean()) < 1.5
