"""A small campaign, from simulated files to the summary: edges that get blunter from batch to batch."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from program_copy import copy_program

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer
from virtual_cell.milling import in_millimetres
from virtual_cell.recipes.slot import PLANS
from virtual_cell.session import Session, cut_all
from virtual_cell.units import DEG, MM
from virtual_cell.write import RUN_COLUMNS, write_csv, write_yaml

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

ROOT = Path(__file__).parents[2]
SHEAR, EDGE = (842.0, 317.0, 176.0), (14.2, 17.8, 3.9)
GROWTH = 0.04  # of the edge coefficients, from batch to batch; within one there is none
BATCHES = 6


def slots(folder, place):
    """Write a batch of slots with an edge that ``place`` batches before have blunted."""
    plans = [
        replace(plan, replicates=2 if plan.role == "identify" else 1, full_s=0.3)
        for plan in PLANS
        if plan.operation == "slot"
    ]
    metal = in_millimetres(SHEAR, tuple((1.0 + GROWTH * place) * edge for edge in EDGE))
    pitch = [120, 120, 120]
    tool = Tool(6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG)
    sensor = Dynamometer(10000.0, "work", np.eye(3), noise=1.0)
    folder.mkdir(parents=True)
    rows = cut_all(Session(tool, metal, sensor), plans, folder, np.random.default_rng(100 + place))
    write_csv(folder / "runs.csv", rows, RUN_COLUMNS)
    write_yaml(folder / "cell.yaml", {"cell": "bench-mill"})
    manifest = {"format": 1, "batch": folder.name, "source": "simulated", "cell": "bench-mill"}
    manifest |= {"tool": {"diameter_mm": 12, "teeth": 3, "helix_deg": 30, "pitch_deg": pitch}}
    manifest |= {"work": {"material": "AA6061-T6"}}
    manifest |= {"instruments": {"dynamometer": {"rate_hz": 10000, "reads": "work", "noise_n": 1.0}}}
    write_yaml(folder / "batch.yaml", manifest)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Return the folder of a campaign whose summary is there."""
    folder = tmp_path_factory.mktemp("campaign")
    copy_program(folder)
    for place in range(BATCHES):
        slots(folder / f"data/raw/slots-{place + 1}", place)
    search = os.pathsep.join([str(folder / "src"), str(ROOT)])
    done = subprocess.run(
        [str(Path(sys.executable).parent / "snakemake"), "--cores", "1", "reports/summary.pdf"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": search, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_wear_from_batch_to_batch_is_followed_and_the_next_batch_predicted(campaign):
    memory = json.loads((campaign / "reports/memory.json").read_text())
    found = {row["quantity"]: row for row in memory["series"]}
    for name, new in zip(("kte", "kre", "kae"), EDGE, strict=True):
        row = found[f"cutting coefficient {name}"]
        assert row["course"] == "trend"
        assert row["batches"] == [f"slots-{i + 1}" for i in range(BATCHES)]
        low, high = row["next"]["ci95"]
        assert low < new * (1.0 + GROWTH * BATCHES) < high
        low, high = row["change"]["ci95"]
        assert low < new * GROWTH * (BATCHES - 1) < high
    for name in ("ktc", "krc", "kac"):
        assert found[f"cutting coefficient {name}"]["course"] == "steady"


def test_no_batch_alone_shows_it_and_no_effect_is_made_of_it(campaign):
    for place in range(BATCHES):
        verdict = json.loads((campaign / f"reports/slots-{place + 1}/verdict.json").read_text())
        assert verdict["observables"]["force"]["status"] == "clean"
    memory = json.loads((campaign / "reports/memory.json").read_text())
    assert [row for row in memory["pooled"] if row["shown"]] == []


def test_the_summary_tells_it(campaign):
    pdf = pypdfium2.PdfDocument(campaign / "reports/summary.pdf")
    text = " ".join(" ".join(page.get_textpage().get_text_range() for page in pdf).split())
    assert "cutting coefficient kte goes by" in text
    assert "from slots-1 to slots-6, steadily" in text
