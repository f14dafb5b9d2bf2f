"""A template of a batch to fill in, with a run table whose repeats are in random order."""

from __future__ import annotations

import importlib.resources
import random
from collections.abc import Iterator
from pathlib import Path
from string import Template

from metro.batch.columns import RUNS
from metro.batch.discover import NAME, NAME_IN_WORDS
from metro.batch.findings import BatchError, Finding
from metro.batch.whole_folder import whole_folder

FEEDS_MM = (0.04, 0.06, 0.08, 0.10)
REPEATS = 2
EXAMPLE = {
    "operation": "side",
    "spindle_rpm": 6000,
    "axial_depth_mm": 3,
    "radial_depth_mm": 4,
    "direction": "down",
    "feed_direction_deg": 0,
    "cut_length_mm": 100,
}


def new_batch(root: Path, name: str) -> Path:
    """Write the template of a batch and return its folder; its own check passes, and lists what to fill in.

    Parameters
    ----------
    root : the folder of the batches.
    name : of the batch, and of its folder.

    Raises
    ------
    BatchError
        The name is not allowed, or the folder is there already.
    ContractError
        The folder cannot be written.
    """
    folder = root / name
    if not NAME.fullmatch(name):
        raise BatchError([Finding("error", name, f"is no name for a batch, expected {NAME_IN_WORDS}")])
    if folder.exists():
        raise BatchError([Finding("error", str(folder), "is there already: nothing was written")])
    texts = importlib.resources.files("metro.batch").joinpath("template")
    with whole_folder(folder) as filled:
        for file in ("batch.yaml", "README.md"):
            text = Template(texts.joinpath(file).read_text(encoding="utf-8"))
            (filled / file).write_text(text.substitute(name=name), encoding="utf-8")
        (filled / "runs.csv").write_text("\n".join(_rows(name)) + "\n", encoding="utf-8")
    return folder


def _rows(name: str) -> Iterator[str]:
    """Yield the run table: each round cuts every condition once, in an order drawn anew (random blocks)."""
    columns = [column.name for column in RUNS]
    yield ",".join(columns)
    draw = random.Random(name)
    rounds = [draw.sample(FEEDS_MM, len(FEEDS_MM)) for _ in range(REPEATS)]
    cuts = [(replicate, feed) for replicate, feeds in enumerate(rounds, 1) for feed in feeds]
    for order, (replicate, feed) in enumerate(cuts, 1):
        row = {
            "run": f"r{order:02d}",
            "condition": f"feed-{feed:.2f}",
            "replicate": replicate,
            "order": order,
        }
        row |= {**EXAMPLE, "feed_per_tooth_mm": feed}
        yield ",".join(str(row.get(column, "")) for column in columns)
