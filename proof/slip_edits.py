"""Edits of a batch's files that make slips; none knows how one is found.

An edit is a function of the folder of a copy. It returns False where the batch has nothing to make it with.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

Edit = Callable[[Path], bool]
FORCES = ("fx_n", "fy_n", "fz_n")


@dataclass(frozen=True)
class Mistake:
    """A slip.

    Attributes
    ----------
    name : in the table. edit : what makes it.
    undecidable : why no data can show it; "" where they can. unless : file of a batch with which they can.
    """

    name: str
    edit: Edit
    undecidable: str = ""
    unless: str = ""

    def why_undecidable(self, folder: Path) -> str:
        """Return why the data of a batch cannot show it; "" where they can."""
        return "" if self.unless and (folder / self.unless).is_file() else self.undecidable


def right_handed() -> Iterator[dict[str, str]]:
    """Yield the 24 right-handed sets of axes as a manifest names them."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            if np.linalg.det(np.array([s * np.eye(3)[i] for i, s in zip(order, signs, strict=True)])) > 0:
                names = [f"{'-' if s < 0 else ''}{'xyz'[i]}" for i, s in zip(order, signs, strict=True)]
                yield dict(zip("xyz", names, strict=True))


def orientation(number: int) -> Mistake:
    """Declare one of the 24 right-handed sets of axes."""
    axes = list(right_handed())[number]
    text = ", ".join(axes.values())

    def edit(content: dict[str, Any]) -> bool:
        sensor = (content.get("instruments") or {}).get("dynamometer")
        declared = {axis: axis for axis in "xyz"} | ((sensor or {}).get("axes") or {})
        if sensor is None or declared == axes:
            return False
        sensor["axes"] = dict(axes)
        return True

    return Mistake(f"axes {text}", manifest(edit))


def manifest(change: Callable[[dict[str, Any]], bool]) -> Edit:
    """Edit batch.yaml of a batch with force records."""

    def edit(folder: Path) -> bool:
        path = folder / "batch.yaml"
        content = yaml.safe_load(path.read_text())
        done = change(content)
        path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True))
        return done and bool(list(files_of(folder, "dynamometer")))

    return edit


def without_axes(content: dict[str, Any]) -> bool:
    """Leave out the axes, where they are not those of the work."""
    sensor = (content.get("instruments") or {}).get("dynamometer") or {}
    axes = sensor.pop("axes", None)
    return axes is not None and any(name != str(value) for name, value in axes.items())


def other_body(content: dict[str, Any]) -> bool:
    """Let the dynamometer read the other body."""
    sensor = (content.get("instruments") or {}).get("dynamometer")
    if sensor is None:
        return False
    sensor["reads"] = "tool" if sensor.get("reads", "work") == "work" else "work"
    return True


def teeth(factor: float) -> Callable[[dict[str, Any]], bool]:
    """Multiply the number of teeth."""

    def change(content: dict[str, Any]) -> bool:
        teeth = (content.get("tool") or {}).get("teeth", 0)
        return set_teeth(content, round(teeth * factor + 0.01))

    return change


def set_teeth(content: dict[str, Any], count: int) -> bool:
    """Declare a number of teeth."""
    tool = content.get("tool") or {}
    if count < 1 or tool.get("teeth") in (None, count):
        return False
    tool.pop("pitch_deg", None)
    tool["teeth"] = count
    for of_teeth in ("pitch_error", "uneven_teeth"):
        content.get("known", {}).pop(of_teeth, None)
    return True


def _table(folder: Path) -> pd.DataFrame:
    path = folder / "runs.csv"
    return pd.read_csv(path, dtype=str, keep_default_na=False) if path.exists() else pd.DataFrame()


def files_of(folder: Path, column: str) -> Iterator[Path]:
    """Yield the files that a column of runs.csv names."""
    table = _table(folder)
    for file in table.get(column, []):
        if file:
            yield folder / file


def runs(change: Callable[[pd.DataFrame], bool]) -> Edit:
    """Edit runs.csv."""

    def edit(folder: Path) -> bool:
        table = _table(folder)
        done = len(table) > 0 and change(table)
        if done:
            table.to_csv(folder / "runs.csv", index=False)
        return done

    return edit


def column(name: str, factor: float) -> Edit:
    """Multiply a column of runs.csv, where there are force records."""

    def change(table: pd.DataFrame) -> bool:
        if name not in table or not (table.get("dynamometer", pd.Series(dtype=str)) != "").any():
            return False
        table[name] = [f"{float(text) * factor:.6g}" if text else "" for text in table[name]]
        return True

    return runs(change)


def swapped(column: str) -> Edit:
    """Exchange the files of the first two runs whose settings differ most."""

    def change(table: pd.DataFrame) -> bool:
        pair = _unlike(table, column)
        if pair is None:
            return False
        one, other = pair
        table.loc[[one, other], column] = table.loc[[other, one], column].to_numpy()
        return True

    return runs(change)


def _unlike(table: pd.DataFrame, column: str) -> tuple[Any, Any] | None:
    """Return two rows with a file and with other feeds, depths or directions, and one speed."""
    if column not in table:
        return None
    names = ["feed_per_tooth_mm", "axial_depth_mm", "direction", "feed_direction_deg", "operation"]
    with_file = table[table[column] != ""]
    names = [name for name in names if name in table]
    for one, other in itertools.combinations(with_file.index, 2):
        same_speed = table["spindle_rpm"][one] == table["spindle_rpm"][other]
        same_kind = table["operation"][one] == table["operation"][other]
        if same_speed and same_kind and (table.loc[one, names] != table.loc[other, names]).any():
            return one, other
    return None


def shifted(column: str) -> Edit:
    """Give each run the file of the run before."""

    def change(table: pd.DataFrame) -> bool:
        if column not in table or _unlike(table, column) is None:
            return False
        rows = table.index[table[column] != ""]
        table.loc[rows, column] = np.roll(table.loc[rows, column].to_numpy(), 1)
        return True

    return runs(change)


def up_for_down(table: pd.DataFrame) -> bool:
    """Exchange up and down in all runs."""
    swapped = {"up": "down", "down": "up"}
    if "direction" not in table or not table["direction"].isin(list(swapped)).any():
        return False
    table["direction"] = table["direction"].replace(swapped)
    return True


def one_direction(table: pd.DataFrame) -> bool:
    """Exchange up and down in the first recorded run that has a direction."""
    recorded = table.get("dynamometer", pd.Series("", table.index)) != ""
    rows: Any = (
        table.index[table["direction"].isin(["up", "down"]) & recorded] if "direction" in table else []
    )
    if not len(rows):
        return False
    table.loc[rows[0], "direction"] = {"up": "down", "down": "up"}[table["direction"][rows[0]]]
    return True


def labels_inverted(table: pd.DataFrame) -> bool:
    """Exchange yes and no in the column stable."""
    if "stable" not in table or not (table["stable"] == "no").any():
        return False
    table["stable"] = table["stable"].replace({"yes": "no", "no": "yes"})
    return True
