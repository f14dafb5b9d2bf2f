"""The look at a batch's tables and the heads of its files, and the batch that comes out of it.

:mod:`metro.stages.whole` goes on from here and reads the files wholly, for ``metro check`` and for ingest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from metro.batch import rules
from metro.batch.arm import effects_agree, tables_agree
from metro.batch.batch import Batch
from metro.batch.capabilities import Capability, Stock, nothing_computed
from metro.batch.cell import CELLS, cells_findings, read_cell, shared_cells, stations_path
from metro.batch.discover import NAME, NAME_IN_WORDS
from metro.batch.entries import FILE
from metro.batch.file_names import name_findings
from metro.batch.files import file_findings
from metro.batch.findings import BatchError, Finding, errors, linked_outside
from metro.batch.holdout import plan
from metro.batch.manifest import read_manifest, with_defaults
from metro.batch.runs import HOLE, design_findings, filled, recorded, run_findings
from metro.batch.sources import SECTION
from metro.batch.tables import Table, read_table
from metro.units import JSON

HOLDOUT: JSON = {"share": 0.34, "seed": 1}


@dataclass(frozen=True)
class Loaded:
    """A batch that follows the contract, and its tables, without rows where it has none."""

    batch: Batch
    impacts: pd.DataFrame
    loads: pd.DataFrame
    mass: pd.DataFrame
    touches: pd.DataFrame
    payload: pd.DataFrame
    published: pd.DataFrame
    stations: pd.DataFrame
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class CheckReport:
    """The result of a check: what is there, what can be computed, and what is wrong."""

    folder: Path
    there: tuple[str, ...]
    plan: JSON
    capabilities: tuple[Capability, ...]
    problems: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether the batch can be run."""
        return not errors(self.problems)


@dataclass(frozen=True)
class Examined:
    """All that was read of a batch's tables, sound or not."""

    folder: Path
    manifest: JSON
    cell: JSON
    tables: Mapping[str, Table]
    runs: pd.DataFrame
    plan: JSON
    findings: tuple[Finding, ...]

    @property
    def stock(self) -> Stock:
        """What the tables say that the batch holds."""
        frames = {name: table.frame for name, table in self.tables.items()}
        return Stock(self.manifest, self.cell, self.runs, frames)

    def report(self, able: Callable[[Stock], tuple[Capability, ...]]) -> CheckReport:
        """Return what is to be shown; ``able`` says what can be computed from what there is."""
        counts = [f"{len(table.frame)} rows in {table.file}" for table in self.tables.values() if table.file]
        declared = self.manifest.get("instruments")
        instruments = sorted(declared) if isinstance(declared, dict) else []  # an error says where it is none
        there = [f"cell {self.cell.get('cell', '')}", *counts]
        there += [f"instruments: {', '.join(instruments)}"] if instruments else []
        can = able(self.stock)
        nothing = [] if errors(self.findings) else nothing_computed(can)
        return CheckReport(self.folder, tuple(there), self.plan, can, (*self.findings, *nothing))

    def loaded(self) -> Loaded:
        """Return the batch, defaults filled in and every recorded run with a role.

        Raises
        ------
        BatchError
            With every error that was found.
        """
        if errors(self.findings):
            raise BatchError(errors(self.findings))
        name, runs = self.folder.resolve().name, self.runs.set_index("run")
        batch = Batch(name, self.manifest, self.cell, runs, self.plan)
        frames: dict[str, Any] = {name: table.frame for name, table in self.tables.items() if name != "runs"}
        return Loaded(batch, findings=self.findings, **frames)


def _nothing(_stock: Stock) -> tuple[Capability, ...]:
    return ()


def check(
    folder: Path,
    cells: Path = CELLS,
    holdout: JSON = HOLDOUT,
    able: Callable[[Stock], tuple[Capability, ...]] = _nothing,
) -> CheckReport:
    """Check a batch in seconds: manifest, cell, every table, and the first rows of every file that they name.

    Parameters
    ----------
    folder : the batch.
    cells : folder of the shared cells.
    holdout : share and seed of the hold-out plan, as in config.yaml.
    able : says what can be computed from what there is (:func:`metro.observables.catalogue.capabilities`).
    """
    return examine(folder, cells, holdout).report(able)


def load(folder: Path, cells: Path = CELLS, holdout: JSON = HOLDOUT) -> Loaded:
    """Check a batch and return it, defaults filled in and every recorded run with a role.

    Raises
    ------
    BatchError
        With every error that the check found.
    """
    return examine(folder, cells, holdout).loaded()


def examine(folder: Path, cells: Path, holdout: JSON) -> Examined:
    """Read and check all of a batch; go on after an error as far as makes sense."""
    manifest, findings = read_manifest(folder)
    if not NAME.fullmatch(folder.resolve().name):
        findings.append(Finding("error", str(folder), f"the name of a batch is made of {NAME_IN_WORDS}"))
    cell, source, more = _cell(folder, cells, manifest)
    findings += more
    tables: dict[str, Table] = {}
    for name in ("runs", "impacts", "loads", "mass", "touches", "payload", "published"):
        tables[name], more = read_table(folder, name)
        findings += more
    tables["stations"], more = _stations(cell, source)
    findings += more
    faulty = {finding.column.split(".")[0] for finding in errors(findings) if finding.file == FILE}
    sound = {key: value for key, value in manifest.items() if key not in faulty}
    unread = not manifest or HOLE in faulty
    findings += [*run_findings(tables["runs"], sound, unread), *name_findings(tables["runs"], _teeth(sound))]
    findings += rules.impact_findings(tables["impacts"])
    tables["loads"], more = rules.with_their_load(tables["loads"])
    findings += more
    findings += [*rules.load_findings(tables["loads"]), *rules.mass_findings(tables["mass"])]
    findings += [*rules.touch_findings(tables["touches"]), *rules.payload_findings(tables["payload"])]
    findings += [*rules.published_findings(tables["published"]), *rules.station_findings(tables["stations"])]
    findings += file_findings(folder, tables["runs"], tables["impacts"], sound.get(SECTION) or {})
    findings += [*tables_agree(cell, tables), *effects_agree(cell, sound.get("known") or {}, FILE)]
    runs = filled(tables["runs"].frame, sound)
    findings += [*design_findings(runs, tables["runs"].file), *_about_the_whole(sound, tables, runs)]
    roles = plan(runs, holdout["share"], holdout["seed"])
    given = {run: role for role in ("identify", "validate") for run in roles[role]}
    runs["role"] = pd.Series([given.get(run, "") for run in runs["run"]], runs.index, dtype=str)
    if not errors(findings):
        manifest = with_defaults(_with_dynamometer(manifest, runs))
        impacts = tables["impacts"].frame
        impacts["response_unit"] = impacts["response_unit"].mask(impacts["response_unit"] == "", "m")
    return Examined(folder, manifest, cell, tables, runs, roles, tuple(findings))


def _teeth(manifest: JSON) -> float | None:
    """Return the number of teeth, where the manifest has a tool with one."""
    tool = manifest.get("tool") or {}
    return tool.get("teeth") if isinstance(tool.get("teeth"), int) else None


def _cell(folder: Path, cells: Path, manifest: JSON) -> tuple[JSON, Path | None, list[Finding]]:
    """Read the cell that the manifest names."""
    name = manifest.get("cell")
    cell, source, findings = read_cell(folder, cells, name) if isinstance(name, str) else ({}, None, [])
    return cell, source, [*cells_findings(shared_cells(cells)), *findings]


def _stations(cell: JSON, source: Path | None) -> tuple[Table, list[Finding]]:
    """Read the stations of the cell, where it names a table of them."""
    path = stations_path(cell, source)
    if path is None or source is None:
        return read_table(Path(), "stations", "")
    outside = linked_outside(source.parent, path.parent, f"{source.name}: stations")
    if outside:
        return read_table(Path(), "stations", "")[0], outside
    table, findings = read_table(path.parent, "stations", path.stem)
    if not table.file:
        message = f'"{cell["stations"]}" is not there, expected a table beside {source.name}'
        findings.append(Finding("error", source.name, message, column="stations"))
    return table, findings


def _about_the_whole(manifest: JSON, tables: Mapping[str, Table], runs: pd.DataFrame) -> list[Finding]:
    """Report what the batch as a whole leaves open."""
    findings = []
    silent = int((~recorded(runs)).sum())
    if silent:
        message = (
            f"{silent} of {len(runs)} rows have neither role nor files: cuts that were made but not recorded"
        )
        findings.append(Finding("note", tables["runs"].file, message))
    declared = manifest.get("instruments") or {}
    if (runs["dynamometer"] != "").any() and "dynamometer" not in declared and manifest:
        message = "is missing: taken to read the force on the work, its axes those of the work"
        findings.append(Finding("warning", FILE, message, column="instruments.dynamometer"))
    return findings


def _with_dynamometer(manifest: JSON, runs: pd.DataFrame) -> JSON:
    """Return the manifest with a dynamometer among its instruments where the runs have its files."""
    if not (runs["dynamometer"] != "").any():
        return manifest
    return {**manifest, "instruments": {"dynamometer": {}, **(manifest.get("instruments") or {})}}
