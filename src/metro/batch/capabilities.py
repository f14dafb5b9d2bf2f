"""What can be computed from a batch, from what, and what is missing for the others.

Each observable states its own needs with these names; :mod:`metro.observables.catalogue` has them all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from metro.batch.entries import FILE, entry
from metro.batch.findings import Finding
from metro.batch.tables import records
from metro.units import JSON

TOOL = ("tool.diameter_mm", "tool.teeth", "tool.helix_deg")
CUT, ARC = (
    ("operation", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm"),
    ("radial_depth_mm", "direction"),
)
FROM_SOLID = ("slot", "helical")
NO_MEASUREMENT = (
    "it holds no measurement: name its files in runs.csv or impacts.csv, "
    "or give load tests in loads.csv or printed values in published.csv"
)
COEFFICIENTS = tuple(f"coefficients.{name}_n_mm2" for name in ("ktc", "krc", "kac"))


@dataclass(frozen=True)
class Capability:
    """An observable, or a step towards it.

    Attributes
    ----------
    name : of the observable.
    source : what it is computed from, in words; "" where it cannot be computed.
    missing : what it lacks, or what would make it more than it is.
    measured : whether the batch holds something that was measured for it; what it lacks is of no interest
        otherwise.
    """

    name: str
    source: str
    missing: tuple[str, ...] = ()
    measured: bool = True


@dataclass(frozen=True)
class Stock:
    """What a batch holds, sound or not.

    Attributes
    ----------
    manifest, cell : as read.
    runs : the run table, filled in, with the roles of the hold-out plan.
    tables : impacts, loads, mass, touches, payload, published, stations.
    """

    manifest: JSON
    cell: JSON
    runs: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]

    def missing_keys(self, keys: Iterable[str]) -> list[str]:
        """Return which of some keys the manifest lacks."""
        return [f"{key} in {FILE}" for key in keys if entry(self.manifest, key) is None]

    def missing_arm(self) -> list[str]:
        """Return what is missing to know where the arm's tip is."""
        needs = [] if self.has_arm() else ["arm.dh in cell.yaml"]
        return needs + self.missing_keys(("tool_in_flange_mm",))

    def has_arm(self) -> bool:
        """Return whether the cell says where the arm's joints are."""
        return bool(entry(self.cell, "arm.dh") or entry(self.cell, "arm.urdf"))

    def missing_coefficients(self) -> list[str]:
        """Return what is missing to have cutting coefficients, given or identified."""
        declared = not self.missing_keys(COEFFICIENTS)
        recorded = self.runs[self.runs["dynamometer"] != ""]
        identified = not (missing_files(recorded, "dynamometer") + self.missing_keys(TOOL))
        return (
            []
            if declared or identified
            else ["cutting coefficients: dynamometer files, or coefficients in batch.yaml"]
        )


Needs = Callable[[Stock], tuple[Capability, ...]]


def capability(
    name: str, source: str, needs: Iterable[str], wishes: Iterable[str] = (), *, measured: bool
) -> Capability:
    """Return a capability that is there where a source is and nothing that it needs is missing."""
    lacking = tuple(dict.fromkeys(needs))
    return Capability(name, "" if lacking else source, lacking or tuple(dict.fromkeys(wishes)), measured)


def nothing_computed(capabilities: Sequence[Capability], unfit: Sequence[str] = ()) -> list[Finding]:
    """Report that nothing can be computed from a batch, where it is so: with what each of its data lacks.

    ``unfit``: why recordings were left out, each with its file; there may be none left.
    """
    if not capabilities or any(each.source for each in capabilities):
        return []
    lacking = [f"{each.name} lacks {', '.join(each.missing)}" for each in capabilities if each.measured]
    more = f" (and {plural(len(unfit) - 1, 'other')})" if len(unfit) > 1 else ""
    left_out = [f"its recordings are not fit for use: {unfit[0]}{more}"] if unfit else []
    why = "; ".join([*lacking, *left_out]) or NO_MEASUREMENT
    return [Finding("error", "", f"nothing can be computed from this batch: {why}")]


def missing_files(runs: pd.DataFrame, column: str) -> list[str]:
    """Return the files that are missing where no run has one."""
    return [] if len(runs) else [f"{column} files in runs.csv"]


def blank_settings(row: Mapping[str, Any]) -> list[str]:
    """Return which settings of a cut a row of the run table leaves blank.

    A slot and a hole need neither a radial depth nor a direction: they are cut from the solid. Of a row that
    has not all columns, those that it has are looked at.
    """
    arc = () if row.get("operation") in FROM_SOLID else ARC
    return [name for name in (*CUT, *arc) if name in row and (row[name] == "" or row[name] != row[name])]


def described(runs: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the runs whose settings are all given, and what is blank in how many of the others."""
    blank = [blank_settings(row) for row in records(runs)]
    names = [name for one in blank for name in one]
    lacking = [f"{name} in {names.count(name)} of {len(runs)} of these runs" for name in dict.fromkeys(names)]
    return runs.loc[[not one for one in blank]], lacking


def missing_roles(runs: pd.DataFrame) -> list[str]:
    """Return the roles that none of the runs has."""
    lacking = {
        "identify": "a run that identifies",
        "validate": "a run that is held out (at least 3 conditions)",
    }
    return [words for role, words in lacking.items() if role not in set(runs["role"])]


def count(runs: pd.DataFrame, what: str) -> str:
    """Say how many runs have something, and how many of them are held out."""
    held = int((runs["role"] == "validate").sum())
    return f"{plural(len(runs), 'run')} with {what}, {held} held out"


def plural(number: int, name: str) -> str:
    """Return a number with what it counts: 1 run, 2 runs, 3 batches."""
    ending = "" if number == 1 else "es" if name.endswith("ch") else "s"
    return f"{number} {name}{ending}"
