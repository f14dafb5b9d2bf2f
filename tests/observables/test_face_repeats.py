"""A granite plate scanned twice: from the batch folder to what the report says of its flatness."""

import json
import os
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.batch.batch import Batch
from metro.batch.processed import read_batch, read_table
from metro.observables.flatness.repeats import repeat_scans, scanned_again

ROOT = Path(__file__).resolve().parents[2]
GRANITE = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")) / "reference/granite"
there = pytest.mark.skipif(not GRANITE.is_dir(), reason="METRO_REAL_DATA has no reference/granite")


class Runs:
    """As much of a batch as the grouping of scans asks for."""

    def __init__(self, **columns: list[str]) -> None:
        count = len(columns["condition"])
        blank = {"scan": ["s.ply"] * count, "operation": [""] * count}
        index = pd.Index([f"r{i}" for i in range(count)])
        self.runs = pd.DataFrame(blank | columns, index=index)


def test_scans_of_one_condition_show_one_face_where_it_was_cut_once_at_most() -> None:
    runs = Runs(condition=["a", "a", "b", "b", "c"], operation=["face", "", "face", "face", "face"])
    batch = cast("Batch", runs)
    assert repeat_scans(batch) == {"r0": ("r0", "r1"), "r1": ("r0", "r1")}
    assert [scanned_again(batch, run) for run in batch.runs.index] == [False, True, False, False, False]


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stages on a batch of two scans and nothing else; returns the folder of all that they wrote."""
    from metro.stages.identify import identify
    from metro.stages.ingest import ingest
    from metro.stages.loop import loop
    from metro.stages.predict import predict
    from metro.stages.report import report
    from metro.stages.verdict import verdict
    from metro.workflow import Plan

    out = tmp_path_factory.mktemp("plate")
    folder, processed, reports = out / "granite", out / "processed", out / "reports"
    folder.mkdir()
    reports.mkdir()
    manifest = {"format": 1, "batch": "granite", "source": "measured", "cell": "vision-cmm"}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest))
    (folder / "runs.csv").write_text("run,condition,replicate,scan\ns1,plate,1,s1.xyz\ns2,plate,2,s2.xyz\n")
    for run, scan in (("s1", "004"), ("s2", "007")):
        lines = (GRANITE / f"ASTRAL_GRANITE_VISION_FLATNESS_{scan}.csv").read_text().splitlines()
        rows = [line.split(",") for line in lines if line.count(",") >= 6 and line.split(",")[0].isdigit()]
        (folder / f"{run}.xyz").write_text("\n".join(" ".join(row[1:4]) for row in rows))
    plan = Plan.read(ROOT, {})
    stages = {
        name: json.loads(plan.settings(name))
        for name in ("ingest", "identify", "predict", "loop", "verdict", "report")
    }
    ingest(folder, ROOT / "config/cells", processed, stages["ingest"], "c0de")
    identify(processed, stages["identify"], "c0de")
    predict(processed, stages["predict"], "c0de")
    loop(processed, reports, stages["loop"], "c0de")
    verdict(processed, reports, stages["verdict"], "c0de")
    report(processed, reports, stages["report"], "c0de")
    return out


@there
def test_noise_of_the_plate_is_twenty_micrometres_and_its_flatness_is_not_123(plate: Path) -> None:
    indices = read_table(plate / "processed/face_indices.parquet")
    xm = indices[indices["index_name"] == "xm"].set_index("run")
    assert xm["value_um"].to_numpy() == pytest.approx([123.3, 124.1], abs=0.1)
    assert xm["sigma_um"].to_numpy() == pytest.approx(20.0, abs=1.5)
    low = xm["corrected_um"] - 1.96 * xm["u_um"]
    assert (xm["corrected_um"] < 30).all()
    assert (low < 5).all()  # truly flat to a few µm
    assert (np.array(xm["sigma_source"].str.contains("16.4"))).all()  # what the two scans differ by


@there
def test_the_report_says_that_the_reading_is_noise(plate: Path) -> None:
    import pypdfium2

    document = pypdfium2.PdfDocument(plate / "reports/report.pdf")
    text = " ".join(" ".join(page.get_textpage().get_text_range() for page in document).split())
    assert "Noise, not flatness, is what X_m of these scans reads" in text
    assert "s1: X_m reads 123 µm, but 102 µm of that is what noise of 20 µm per point makes" in text
    assert "too few of them for an areal filter" in text
    assert repeat_scans(read_batch(plate / "processed")).keys() == {"s1", "s2"}
