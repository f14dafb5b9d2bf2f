"""What can be computed from a batch, from what, and what is missing for the rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from metro.batch.manifest import FILE, entry
from metro.units import JSON

TOOL = ("tool.diameter_mm", "tool.teeth", "tool.helix_deg")
CUT = ("operation", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm", "direction")
COEFFICIENTS = tuple(f"coefficients.{name}_n_mm2" for name in ("ktc", "krc", "kac"))


@dataclass(frozen=True)
class Capability:
    """An observable, or a step towards it.

    Attributes
    ----------
    name : of the observable.
    source : what it is computed from, in words; "" where it cannot be computed.
    missing : what it lacks, or what would make it more than it is.
    """

    name: str
    source: str
    missing: tuple[str, ...] = ()


def capabilities(
    manifest: JSON, cell: JSON, runs: pd.DataFrame, tables: Mapping[str, pd.DataFrame]
) -> tuple[Capability, ...]:
    """Say for every observable whether it can be had.

    Parameters
    ----------
    manifest, cell : as read.
    runs : the run table, filled in, with the roles of the hold-out plan.
    tables : impacts, loads, mass, published, stations.
    """
    force = runs[runs["dynamometer"] != ""]
    coefficients = _coefficients(manifest, force)
    answers = (
        _force(manifest, force),
        _joint_force(manifest, cell, runs),
        _deformation(manifest, cell, runs, tables["loads"], coefficients),
        _waviness(manifest, cell, runs),
        _modes(tables["impacts"]),
        _lobes(manifest, runs, tables["impacts"], coefficients),
        _flatness(runs, tables["loads"], coefficients),
    )
    return answers if tables["published"].empty else (*answers, _printed(tables["published"]))


def _capability(name: str, source: str, needs: Iterable[str], wishes: Iterable[str] = ()) -> Capability:
    """Return a capability that is there where a source is and nothing that it needs is missing."""
    lacking = tuple(dict.fromkeys(needs))
    return Capability(name, "" if lacking else source, lacking or tuple(dict.fromkeys(wishes)))


def _force(manifest: JSON, runs: pd.DataFrame) -> Capability:
    needs = [*_files(runs, "dynamometer"), *_keys(manifest, TOOL), *_filled(runs, CUT)]
    return _capability("force", _count(runs, "a dynamometer file"), needs, _roles(runs))


def _joint_force(manifest: JSON, cell: JSON, runs: pd.DataFrame) -> Capability:
    logged = runs[(runs["robot_log"] != "") & (runs["idle_log"] != "")]
    needs = [*_arm(manifest, cell), *_logs(logged)]
    compared = logged[logged["dynamometer"] != ""]
    wishes = _roles(compared) if len(compared) else ["a dynamometer file in the same runs, to compare with"]
    return _capability("joint force", _count(logged, "robot_log and idle_log"), needs, wishes)


def _deformation(
    manifest: JSON, cell: JSON, runs: pd.DataFrame, loads: pd.DataFrame, coefficients: list[str]
) -> Capability:
    traced = runs[runs["profile"] != ""]
    needs = [*_files(traced, "profile"), *_arm(manifest, cell)]
    if "joint_stiffness_nm_rad" not in cell and loads.empty:
        needs.append("loads.csv, or joint_stiffness_nm_rad in cell.yaml")
    if not (traced["robot_log"] != "").any():
        needs.append("robot_log in the runs that have a profile: the arm's pose")
    has_force = ((traced["idle_log"] != "") | (traced["dynamometer"] != "")).any()
    if coefficients and not has_force:
        needs += ["the force: idle_log or dynamometer in those runs, or", *coefficients]
    return _capability("deformation", _count(traced, "a profile"), needs, _roles(traced))


def _waviness(manifest: JSON, cell: JSON, runs: pd.DataFrame) -> Capability:
    traced = runs[runs["profile"] != ""]
    needs = [*_files(traced, "profile"), *_arm(manifest, cell)]
    if not (traced["robot_log"] != "").any():
        needs.append("robot_log in the runs that have a profile")
    return _capability("waviness", _count(traced, "a profile"), needs, _roles(traced))


def _modes(impacts: pd.DataFrame) -> Capability:
    needs = [] if len(impacts) else ["impacts.csv"]
    records = int((impacts["kind"] == "record").sum())
    return _capability("modes", f"{records} hammer records, {len(impacts) - records} FRFs", needs)


def _lobes(manifest: JSON, runs: pd.DataFrame, impacts: pd.DataFrame, coefficients: list[str]) -> Capability:
    needs = [*([] if len(impacts) else ["impacts.csv: the modes"]), *coefficients]
    needs += _keys(manifest, ("tool.diameter_mm", "tool.teeth"))
    needs += [] if len(runs) else ["runs.csv: the immersion and the range of speeds"]
    labelled = runs[(runs["stable"] != "") | (runs["dynamometer"] != "")]
    wishes = (
        _roles(labelled) if len(labelled) else ["stable, or a dynamometer file, in runs.csv to compare with"]
    )
    return _capability(
        "lobes", f"modes and coefficients; {len(labelled)} runs to compare with", needs, wishes
    )


def _flatness(runs: pd.DataFrame, loads: pd.DataFrame, coefficients: list[str]) -> Capability:
    scanned = runs[runs["scan"] != ""]
    planned = runs[(runs["operation"] == "face") & (runs["path"] != "")]
    if scanned.empty and len(planned) and len(loads) and not coefficients:
        source = f"{_plural(len(planned), 'planned face')}: a prediction alone"
        return Capability("flatness", source, ("scan files in runs.csv, to compare with",))
    wishes = list(coefficients)
    if not loads[["x_mm", "y_mm", "z_mm"]].notna().all(axis=1).any():
        wishes.append("loads.csv with x_mm, y_mm, z_mm: the stiffness along the path")
    if not (scanned["path"] != "").all():
        wishes.append("path in every run that has a scan")
    if wishes:
        wishes = ["for the prediction:", *wishes]
    source = _count(scanned, "a scan") + (" (indices alone)" if wishes else "")
    return _capability("flatness", source, _files(scanned, "scan"), wishes or _roles(scanned))


def _printed(published: pd.DataFrame) -> Capability:
    pairs = int(published[["measured", "predicted"]].notna().all(axis=1).sum())
    return Capability("printed values", f"{len(published)} rows of published.csv, {pairs} of them pairs")


def _coefficients(manifest: JSON, force: pd.DataFrame) -> list[str]:
    """Return what is missing to have cutting coefficients, given or identified."""
    declared = not _keys(manifest, COEFFICIENTS)
    identified = not (_files(force, "dynamometer") + _keys(manifest, TOOL))
    return (
        []
        if declared or identified
        else ["cutting coefficients: dynamometer files, or coefficients in batch.yaml"]
    )


def _files(runs: pd.DataFrame, column: str) -> list[str]:
    return [] if len(runs) else [f"{column} files in runs.csv"]


def _keys(manifest: JSON, keys: Iterable[str]) -> list[str]:
    return [f"{key} in {FILE}" for key in keys if entry(manifest, key) is None]


def _filled(runs: pd.DataFrame, columns: Iterable[str]) -> list[str]:
    blank = {column: int((runs[column].isna() | (runs[column] == "")).sum()) for column in columns}
    return [f"{column} in {n} of {len(runs)} of these runs" for column, n in blank.items() if n]


def _arm(manifest: JSON, cell: JSON) -> list[str]:
    needs = [] if entry(cell, "arm.dh") else ["arm.dh in cell.yaml"]
    return needs + _keys(manifest, ("tool_in_flange_mm",))


def _logs(runs: pd.DataFrame) -> list[str]:
    return [] if len(runs) else ["robot_log and idle_log files of one run in runs.csv"]


def _roles(runs: pd.DataFrame) -> list[str]:
    """Return the roles that none of the runs has."""
    lacking = {
        "identify": "a run that identifies",
        "validate": "a run that is held out (at least 3 conditions)",
    }
    return [words for role, words in lacking.items() if role not in set(runs["role"])]


def _count(runs: pd.DataFrame, what: str) -> str:
    held = int((runs["role"] == "validate").sum())
    return f"{_plural(len(runs), 'run')} with {what}, {held} held out"


def _plural(count: int, name: str) -> str:
    return f"{count} {name}{'' if count == 1 else 's'}"
