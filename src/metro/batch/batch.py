"""A batch as every stage after ingest sees it: manifest, cell, run table and hold-out plan."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from metro.units import JSON


@dataclass(frozen=True)
class Batch:
    """What describes a batch, validated, with defaults filled in; units as the keys name them.

    Attributes
    ----------
    name : the folder's name.
    manifest : batch.yaml.
    cell : cell.yaml or config/cells/<cell>.yaml; ``{"cell": name}`` alone for a machine of which nothing is
        known.
    runs : one row per cutting run, indexed by run id, all columns of the contract present (NaN or "" where
        blank), and ``cut_before_m``: metres cut since ``order`` 1 before the run began. ``role`` is resolved:
        identify, validate, or "" for a cut that was made but not recorded.
    plan : how the hold-out was made: ``{"identify": [...], "validate": [...], "how": "...", "seed": n}``.
    """

    name: str
    manifest: JSON
    cell: JSON
    runs: pd.DataFrame
    plan: JSON

    def instrument(self, name: str) -> JSON:
        """Return an instrument's entry in the manifest; empty where it has none."""
        entry: JSON = (self.manifest.get("instruments") or {}).get(name) or {}
        return entry

    @property
    def started(self) -> float | None:
        """When the first run began, s since 1970; None where no run says. Without a zone it is UTC."""
        if "started_at" not in self.runs:
            return None
        at = pd.to_datetime(self.runs["started_at"], format="ISO8601", utc=True, errors="coerce").min()
        return None if pd.isna(at) else float(at.timestamp())

    def with_files(self, *columns: str, any_of: bool = False) -> list[str]:
        """List the runs, in the order of cutting, that name a file in all (or any) of ``columns``.

        A column that the table lacks names none.
        """
        table = self.runs.sort_values("order", kind="stable")
        named = table.reindex(columns=list(columns)).map(lambda file: isinstance(file, str) and file != "")
        have = named.any(axis=1) if any_of else named.all(axis=1)
        return [str(run) for run in table.index[have.to_numpy(dtype=bool)]]
