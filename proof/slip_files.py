"""Edits of the recordings of a batch that make slips; none knows how one is found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from metro.formats.registry import read
from proof.slip_edits import Edit, files_of


def copied(column: str) -> Edit:
    """Put the values of one file in the place of another, as other bytes."""

    def edit(folder: Path) -> bool:
        files = [file for file in files_of(folder, column) if file.suffix in (".parquet", ".csv", ".ply")]
        if len(files) < 2:
            return False
        if files[0].suffix == ".ply":
            _write_ply(files[1], _read_ply(files[0]))
            with files[1].open("ab") as stream:
                stream.write(b"")
            return True
        if files[0].suffix == ".csv":
            _write_record(files[1], read(files[0], "force"))
            return True
        pd.read_parquet(files[0]).to_parquet(files[1], compression="gzip")
        return True

    return edit


def records(change: Callable[[pd.DataFrame], None], rate: float = 1.0) -> Edit:
    """Edit every force record; ``rate``: factor on the declared rate."""

    def edit(folder: Path) -> bool:
        files = [file for file in files_of(folder, "dynamometer") if file.suffix in (".parquet", ".csv")]
        for file in files:
            table = read(file, "force")
            change(table)
            _write_record(file, table)
        if files and rate != 1.0:
            path = folder / "batch.yaml"
            content = yaml.safe_load(path.read_text())
            sensor = content["instruments"]["dynamometer"]
            sensor["rate_hz"] = sensor.get("rate_hz", 10000) * rate
            path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True))
        return bool(files)

    return edit


def _write_record(file: Path, table: pd.DataFrame) -> None:
    """Write a force record; a text of any program becomes a plain one, with all digits."""
    if file.suffix == ".parquet":
        table.to_parquet(file)
    else:
        table.to_csv(file, index=False)


def times(name: str, factor: float) -> Callable[[pd.DataFrame], None]:
    """Multiply a channel."""

    def change(table: pd.DataFrame) -> None:
        table[name] = factor * table[name]

    return change


def exchanged(table: pd.DataFrame) -> None:
    """Exchange fx and fy."""
    table[["fx_n", "fy_n"]] = table[["fy_n", "fx_n"]].to_numpy()


def doubled(table: pd.DataFrame) -> None:
    """Record fx in both channels."""
    table["fy_n"] = table["fx_n"]


def slower(factor: float) -> Callable[[pd.DataFrame], None]:
    """Stretch the time."""

    def change(table: pd.DataFrame) -> None:
        table["t_s"] = factor * table["t_s"]

    return change


def logs(change: Callable[[pd.DataFrame], None]) -> Edit:
    """Edit every robot log."""

    def edit(folder: Path) -> bool:
        files = [*files_of(folder, "robot_log"), *files_of(folder, "idle_log")]
        for file in dict.fromkeys(files):
            table = pd.read_parquet(file)
            change(table)
            table.to_parquet(file)
        return bool(files)

    return edit


def signs(table: pd.DataFrame, joints: Any) -> None:
    """Turn the sign of the torque of joints."""
    for joint in joints:
        table[f"tau{joint}_nm"] = -table[f"tau{joint}_nm"]


def joints_exchanged(table: pd.DataFrame) -> None:
    """Exchange the torques of joints 1 and 3."""
    table[["tau1_nm", "tau3_nm"]] = table[["tau3_nm", "tau1_nm"]].to_numpy()


def radians(table: pd.DataFrame) -> None:
    """Write joint angles in radians."""
    for joint in range(1, 7):
        for name in (f"q{joint}_deg", f"q{joint}_set_deg"):
            table[name] = np.radians(table[name])


def impacts(unit: str) -> Edit:
    """Declare a unit of the responses."""

    def edit(folder: Path) -> bool:
        path = folder / "impacts.csv"
        if not path.exists():
            return False
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        table["response_unit"] = unit
        table.to_csv(path, index=False)
        return True

    return edit


def _impact_files(folder: Path) -> list[Path]:
    path = folder / "impacts.csv"
    table = pd.read_csv(path, dtype=str) if path.exists() else pd.DataFrame({"file": []})
    names = [str(file).partition("#")[0] for file in table["file"]]  # several records may be in one file
    return [folder / name for name in dict.fromkeys(names) if name.endswith(".parquet")]


def hits(name: str, factor: float) -> Edit:
    """Multiply a channel of every hammer record."""

    def edit(folder: Path) -> bool:
        for file in _impact_files(folder):
            table = pd.read_parquet(file)
            for column in _channels(table, name):
                table[column] = factor * table[column]
            table.to_parquet(file)
        return bool(_impact_files(folder))

    return edit


def hit_copied(folder: Path) -> bool:
    """Put the response of one hammer record into another."""
    files = _impact_files(folder)
    if len(files) < 2:
        return False
    one, other = pd.read_parquet(files[0]), pd.read_parquet(files[1])
    column = _channels(one, "response")[0]
    other[column] = one[column].to_numpy()[: len(other)]
    other.to_parquet(files[1])
    return True


def _channels(table: pd.DataFrame, name: str) -> list[str]:
    """Return the columns of a channel of the contract: its own name, or that name with a number behind."""
    return [column for column in map(str, table) if column == name or column.startswith(f"{name}_")]


def _read_ply(path: Path) -> np.ndarray:
    content = path.read_bytes()
    start = content.index(b"end_header\n") + len(b"end_header\n")
    return np.frombuffer(content[start:], "<f4").reshape(-1, 3).copy()


def _write_ply(path: Path, points: np.ndarray) -> None:
    names = "".join(f"property float {axis}\n" for axis in "xyz")
    kind = "ply\nformat binary_little_endian 1.0\ncomment edited\n"
    head = f"{kind}element vertex {len(points)}\n{names}end_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes())


def clouds(most: int | None) -> Edit:
    """Stretch the heights of the first clouds, or of all, tenfold."""

    def edit(folder: Path) -> bool:
        files = [file for file in dict.fromkeys(files_of(folder, "scan")) if file.suffix == ".ply"]
        for file in files[:most]:
            points = _read_ply(file)
            points[:, 2] = points[:, 2].mean() + 10.0 * (points[:, 2] - points[:, 2].mean())
            _write_ply(file, points)
        return bool(files)

    return edit


def profiles(factor: float) -> Edit:
    """Multiply the heights of every profile."""

    def edit(folder: Path) -> bool:
        files = [file for file in dict.fromkeys(files_of(folder, "profile")) if file.suffix == ".parquet"]
        for file in files:
            table = pd.read_parquet(file)
            table["z_mm"] = factor * table["z_mm"]
            table.to_parquet(file)
        return bool(files)

    return edit
