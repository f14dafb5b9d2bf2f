"""A small batch that follows the contract, to be broken in one place by each test."""

from pathlib import Path

import pytest

MANIFEST = """\
format: 1
batch: trial
source: measured
cell: bench
tool: {diameter_mm: 10, teeth: 4, helix_deg: 30}
hole_diameter_mm: 16
instruments:
  dynamometer: {rate_hz: 1000}
"""
FEEDS = (0.02, 0.04, 0.06, 0.08)
RUNS = (
    "run,operation,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,direction,cut_length_mm,dynamometer\n"
    + ("".join(f"r{i},slot,6000,{feed},1,10,slot,50,dyno/r{i}.csv\n" for i, feed in enumerate(FEEDS, 1)))
)
SIGNAL = "t_s,fx_n,fy_n,fz_n\n" + "".join(f"{i / 1000},{i % 7},{i % 5},{i % 3}\n" for i in range(50))


@pytest.fixture
def batch(tmp_path: Path) -> Path:
    """A batch of four slots with a dynamometer, on a cell of which nothing is known."""
    folder = tmp_path / "trial"
    (folder / "dyno").mkdir(parents=True)
    (folder / "batch.yaml").write_text(MANIFEST)
    (folder / "runs.csv").write_text(RUNS)
    for i in range(1, len(FEEDS) + 1):
        (folder / f"dyno/r{i}.csv").write_text(SIGNAL)
    return folder


def edit(path: Path, old: str, new: str) -> None:
    """Replace text that must be there."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
