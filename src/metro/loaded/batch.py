"""One batch's results, as the pipeline left them: what ``metro.load`` returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.findings import ContractError, Finding
from metro.batch.processed import read_batch, read_json, read_table
from metro.commands.which import PROCESSED_FILE, RAW_FILE, REPORTS_FILE, batch_name
from metro.dataset.results import columns_of, quantities, rows_of
from metro.loaded.quantity import Quantity
from metro.spelling import suggestion
from metro.units import JSON

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from metro.effects.effect import Effect
    from metro.loaded.force import ForcePrediction
    from metro.loaded.lobes import LobePrediction
    from metro.loaded.refit import FitReport
    from metro.stages.problem_file import Posed

DECISIONS = [
    *("quantity", "where", "value", "lo", "hi", "unit", "lower", "upper", "decision", "probability"),
]
COORDINATES = {
    "angle_deg": "spindle angle (°)",
    "s_mm": "path length (mm)",
    "x_mm": "x (mm)",
}


def load(batch: str | Path, project: str | Path = ".") -> LoadedBatch:
    """Open the results of a batch.

    Parameters
    ----------
    batch : its name, or one of its folders (``data/raw/…``, ``data/processed/…``, ``reports/…``).
    project : the folder in which ``metro run`` or snakemake was called; a path of a batch needs none.

    Returns
    -------
    LoadedBatch
        Nothing is read before it is asked for.

    Raises
    ------
    ContractError
        There is no such batch, or it has no results yet.
    """
    project, given = Path(project), Path(batch)
    if len(given.parts) > 1 or given.is_absolute():
        if not given.is_dir():
            raise ContractError([Finding("error", str(given), "there is no such folder")])
        project = _project_of(given.absolute())
        batch = given.absolute().name
    processed, reports = project / "data/processed", project / "reports"
    name = batch_name(str(batch), processed, reports)
    if not (reports / name / REPORTS_FILE).is_file():
        raise ContractError([Finding("error", name, "has no verdict yet: call metro run")])
    return LoadedBatch(name, processed / name, reports / name)


def _project_of(folder: Path) -> Path:
    """Return the project that a folder of a batch is in: the folder above ``data`` or ``reports``."""
    if not any((folder / file).is_file() for file in (RAW_FILE, PROCESSED_FILE, REPORTS_FILE)):
        message = f"is no folder of a batch: it holds none of {RAW_FILE}, {PROCESSED_FILE}, {REPORTS_FILE}"
        raise ContractError([Finding("error", str(folder), message)])
    return folder.parent.parent if folder.parent.name == "reports" else folder.parent.parent.parent


@dataclass(frozen=True)
class LoadedBatch:
    """The results of a batch.

    Attributes
    ----------
    name : of the batch.
    processed : folder of its canonical and observed tables.
    reports : folder of its report, ``identified.json`` and ``verdict.json``.
    """

    name: str
    processed: Path
    reports: Path

    @cached_property
    def description(self) -> Batch:
        """What describes the batch: manifest, cell, run table, hold-out plan."""
        return read_batch(self.processed)

    @property
    def runs(self) -> pd.DataFrame:
        """The run table, indexed by run."""
        return self.description.runs

    @cached_property
    def table_names(self) -> list[str]:
        """Names of the tables that this batch has rows of."""
        import pyarrow.parquet as pq

        paths = sorted(self.processed.glob("*.parquet"))
        return [path.stem for path in paths if pq.read_metadata(path).num_rows]

    def table(self, name: str, run: str | None = None) -> pd.DataFrame:
        """Return a table, or the rows of one run of it; units are in the names of its columns.

        Raises
        ------
        ContractError
            The batch has no such table.
        """
        path = self.processed / f"{name}.parquet"
        if not path.is_file():
            message = f"{self.name} has no such table{suggestion(name, self.table_names)}"
            raise ContractError([Finding("error", name, message)])
        return read_table(path, run)

    @property
    def comparison(self) -> pd.DataFrame:
        """Measured and predicted values of the held-out runs."""
        return self.table("comparison")

    @cached_property
    def identified_json(self) -> JSON:
        """Content of ``identified.json``."""
        return read_json(self.reports / "identified.json")

    @cached_property
    def verdict_json(self) -> JSON:
        """Content of ``verdict.json``."""
        return read_json(self.reports / "verdict.json")

    @property
    def identified(self) -> pd.DataFrame:
        """Identified quantities: ``name, value, lo, hi, unit``; the interval is of 95 %."""
        rows = [
            quantity
            for key, block in self.identified_json.items()
            if key != "format"
            for quantity in quantities(block, key)
        ]
        return pd.DataFrame(rows, columns=["name", "value", "lo", "hi", "unit"])

    def quantity(self, name: str) -> Quantity:
        """Return an identified quantity by the name that :attr:`identified` has: ``force.waveform.ktc``."""
        known = {str(row.pop("name")): row for row in self.identified.to_dict("records")}
        if name not in known:
            words = f"{self.name} has no such quantity{suggestion(name, list(known))}"
            raise ContractError([Finding("error", name, words)])
        row: JSON = {str(key): value for key, value in known[name].items()}
        return Quantity.of({**row, "ci95": [row["lo"], row["hi"]]})

    @property
    def verdicts(self) -> pd.DataFrame:
        """Verdicts, a row per observable: status, unit, noise floor, errors before and after, effects."""
        return self._rows("verdicts").set_index("observable")

    @property
    def effects(self) -> pd.DataFrame:
        """Effects that were found: a row per parameter, with its interval and the effect's probability."""
        return self._rows("effects")

    @property
    def candidates(self) -> pd.DataFrame:
        """Effects that were tried and not taken, with the reason."""
        return self._rows("candidates")

    @property
    def decisions(self) -> pd.DataFrame:
        """Results against the tolerances of ``batch.yaml``, by ISO 14253-1; no rows where it states none."""
        rows = [
            {**entry, "lo": (entry["ci95"] or [None])[0], "hi": (entry["ci95"] or [None])[-1]}
            for entry in self.verdict_json.get("decisions") or []
        ]
        return pd.DataFrame(rows, columns=DECISIONS)

    @property
    def recommended_cuts(self) -> pd.DataFrame:
        """Stable cuts that remove most, by position; no rows where there are no lobes."""
        return pd.DataFrame(self.verdict_json.get("recommended_cuts") or [])

    def force(self, run: str | None = None, **settings: Any) -> ForcePrediction:
        """Predict the cutting force over a revolution, with its 95 % interval.

        Parameters
        ----------
        run : run whose settings are taken where none is given; None: the first one.
        settings : ``operation, direction, spindle_rpm, feed_per_tooth_mm, axial_depth_mm, radial_depth_mm,
            orbit_rpm, feed_direction_deg, cut_length_mm, cut_before_m``.
        """
        from metro.loaded.force import predict_force
        from metro.observables.force.model import ForceModel

        posed = self._problems.get("force")
        model = getattr(posed.task, "base", None) if posed else None
        known = model if isinstance(model, ForceModel) else None
        spindle, entry = self._observed("spindle"), self._entry("force")
        identified = self.identified_json
        return predict_force(
            self.description, known, identified, entry=entry, run=run, spindle=spindle, **settings
        )

    def lobes(
        self,
        position: str | int | None = None,
        rpm: Sequence[float] | None = None,
        run: str | None = None,
        **settings: Any,
    ) -> LobePrediction:
        """Predict the stability boundary of a cut, with its 95 % band.

        Parameters
        ----------
        position : whose modes are used; None: the first. rpm : speeds; None: those about the batch's runs.
        run, settings : as in :meth:`force`; the depth is what is predicted.
        """
        from metro.loaded.lobes import predict_lobes

        return predict_lobes(
            self.description,
            self._observed("modes"),
            self.identified_json,
            self._entry("lobes"),
            position=None if position is None else str(position),
            rpm=rpm,
            run=run,
            **settings,
        )

    def fit(self, observable: str, effects: Sequence[Effect] = ()) -> FitReport:
        """Fit the base model of an observable, with effects of the library or of your own on it.

        This tests a single idea. Whether the data prefer it to every other effect of the library is what the
        pipeline's search decides.
        """
        from metro.loaded.refit import refit

        budget = read_json(self.processed / "identify.made.json")["settings"]["model_form_budget"]
        return refit(self._problems.get(observable), observable, effects, budget)

    def plot(
        self, observable: str, run: str | None = None, axis: str | None = None, axes: Axes | None = None
    ) -> Axes:
        """Draw measured and predicted values of a held-out run; return the axes of matplotlib.

        Parameters
        ----------
        run, axis : which; None: the first that the comparison has. axes : to draw on; None: the current ones.
        """
        from metro.loaded.plots import compared_axes

        rows = self.comparison
        for column, wanted in (("observable", observable), ("run", run), ("axis", axis)):
            known = [str(value) for value in rows[column].dropna().unique()]
            chosen = wanted or (known[0] if known else None)
            if chosen is None:
                continue
            if chosen not in known:
                message = f"is not compared{suggestion(chosen, known) or '; there are: ' + ', '.join(known)}"
                raise ContractError([Finding("error", chosen, message)])
            rows = rows[rows[column].astype(str) == chosen]
        coordinate = next((name for name in COORDINATES if rows[name].notna().any()), None)
        if coordinate is None:
            raise ContractError([Finding("error", observable, "is compared at no place along a run")])
        block = rows[rows["t_s"] == rows["t_s"].iloc[0]] if coordinate == "angle_deg" else rows
        return compared_axes(block.sort_values(coordinate), coordinate, COORDINATES[coordinate], axes)

    @cached_property
    def _problems(self) -> dict[str, Posed]:
        from metro.stages.problem_file import read_problems

        return read_problems(self.processed)

    def _observed(self, name: str) -> pd.DataFrame:
        """Return an observed table; an empty one where the batch has none."""
        return self.table(name) if name in self.table_names else pd.DataFrame()

    def _entry(self, observable: str) -> JSON:
        entry: JSON = (self.verdict_json.get("observables") or {}).get(observable) or {}
        return entry

    def _rows(self, view: str) -> pd.DataFrame:
        rows = rows_of(view, self.name, self.verdict_json)
        return pd.DataFrame(rows, columns=columns_of(view)).drop(columns="batch")

    def __str__(self) -> str:
        statuses = ", ".join(f"{name} {status}" for name, status in self.verdicts["status"].items())
        return f"{self.name}: {statuses or 'no verdict'}"
