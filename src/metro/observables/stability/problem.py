"""Tests with labels: which cuts were stable, and the base model's probability that they were not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from metro.observables.labelled import Result
from metro.observables.stability import boundary as stability
from metro.observables.stability.cases import Case, Change, boundaries, estimates
from metro.observables.task import Handler
from metro.units import Array


@dataclass(frozen=True)
class LabelProblem:
    """Tests that are stable or not, and the base model's probability that they are not.

    Attributes
    ----------
    runs, conditions, roles : (n,) identity of the runs.
    unstable : (n,) whether the run chattered.
    rpm, depth : (n,) rev/min and m.
    probability_unstable : (n,) of the base model.
    notes : what was assumed or left out.
    cases : the models that predict the tests at places whose modes were measured.
    point : (n,) of each test among the speeds of all cases, −1 where it is in none.
    chatter_hz : (n,) measured where the test chattered and its record shows it, else NaN.
    model_sd : standard deviation of the logarithm of the depth for what the models leave out.
    label_error : probability that a label is wrong whatever the depth.
    """

    observable: str
    runs: tuple[str, ...]
    conditions: tuple[str, ...]
    roles: tuple[str, ...]
    unstable: np.ndarray
    rpm: Array
    depth: Array
    probability_unstable: Array
    notes: tuple[str, ...]
    cases: tuple[Case, ...] = ()
    point: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    chatter_hz: Array = field(default_factory=lambda: np.zeros(0))
    model_sd: float = stability.MODEL_SD
    label_error: float = stability.LABEL_ERROR

    @property
    def point_rpm(self) -> Array:
        """(p,) speed of each point, rev/min."""
        speeds: Array = np.concatenate([np.zeros(0), *(case.rpm for case in self.cases)])
        return speeds

    @property
    def point_tooth_hz(self) -> Array:
        """(p,) frequency at which the teeth come at each point, Hz."""
        teeth_hz = [case.model.cuts[0].teeth * case.rpm / 60.0 for case in self.cases]
        frequencies: Array = np.concatenate([np.zeros(0), *teeth_hz])
        return frequencies

    @property
    def point_cut(self) -> np.ndarray:
        """(p,) case of each point: a cut at a place."""
        return np.repeat(np.arange(len(self.cases)), [len(case.rpm) for case in self.cases])

    def boundaries(self, changes: Sequence[Change]) -> tuple[Array, Array]:
        """Log depths and chatter frequencies (t, p), Hz, of the boundary after each of t changes."""
        return boundaries(self.cases, changes)

    def estimates(self, changes: Sequence[Change]) -> tuple[Array, Array]:
        """Return the same, to zeroth order."""
        return estimates(self.cases, changes)

    def case_at(self, position: str | None = None) -> Case | None:
        """Return the case with most of the tests, of all or of those at a position."""
        tests = np.bincount(self.point_cut[self.point[self.point >= 0]], minlength=len(self.cases))
        there = [i for i, case in enumerate(self.cases) if position in (None, case.position)]
        return self.cases[max(there, key=lambda i: int(tests[i]))] if there else None

    def boundaries_at(self, changes: Sequence[Change], rpm: Array) -> Array:
        """Log depths (t, k) of boundaries at speeds (k,), rev/min, in the case with most of the tests."""
        case = self.case_at()
        assert case is not None
        return boundaries([case.at(rpm)], changes)[0]

    def deviations(self, draws: int, seed: int) -> Array:
        """(draws, p) deviations of the log depth by what modes and coefficients are uncertain of."""
        every: Array = np.concatenate([case.deviations(draws, seed) for case in self.cases], axis=1)
        return every

    def comparison(self) -> pd.DataFrame:
        """Rows of the comparison table: measured 1 is unstable; before and after, the probability of that."""
        held = np.array([role == "validate" for role in self.roles], dtype=bool)
        probability = self.probability_unstable[held]
        return pd.DataFrame(
            {
                "observable": self.observable,
                "run": np.array(self.runs, dtype=object)[held],
                **dict.fromkeys(("axis", "t_s", "angle_deg", "s_mm", "x_mm", "y_mm")),
                "measured": self.unstable[held].astype(float),
                "before": probability,
                "after": probability,
                "sigma": None,
                "unit": "1",
            },
            index=range(int(held.sum())),
        )

    def redrawn(self, observed: Mapping[str, pd.DataFrame], change: Change) -> dict[str, pd.DataFrame]:
        """Return the table ``lobes`` with the boundaries of changed models, bands in proportion."""
        diagram, parts = observed["lobes"], []
        for position, rows in diagram.groupby("position", sort=False):
            case = self.case_at(str(position))
            if case is None:
                parts.append(rows)
                continue
            here = case.at(rows["rpm"].to_numpy(float))
            (before, after), (_, chatter) = boundaries([here], [lambda model: model, change])
            depths = [name for name in rows.columns if str(name).startswith(("depth", "error"))]
            scaled = rows[depths].mul(np.exp(after - before), axis=0)
            parts.append(rows.assign(**scaled, chatter_hz=chatter)[np.isfinite(after)])
        return {"lobes": pd.concat(parts, ignore_index=True) if parts else diagram}

    def with_notes(self, notes: Sequence[str]) -> LabelProblem:
        """Return the problem with further notes."""
        return replace(self, notes=(*self.notes, *notes))

    def handled_by(self, handler: Handler[Result]) -> Result:
        """Let a handler do with the problem what it does with those whose measurements are labels."""
        return handler.labelled(self)
