"""Factorial study and ranking of the faces of a batch: from the run table and the flatness indices.

The primary index is tested without adjustment: X_m less the contribution of noise. The tests of the other
indices are adjusted for their number (Holm).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.quantity import quantity
from metro.surface.factorial import (
    Effect,
    Fitted,
    cell_means,
    contrasts,
    f_test,
    fit_design,
    holm,
    level_effects,
    t_quantile,
)
from metro.surface.factors import Alias, Design, Factor, Term, find_factors, make_design
from metro.surface.ranking import Agreement, agreement, posterior_draws, probability_best
from metro.units import JSON, Array

PRIMARY = "xm"
OTHERS = ("xa", "xg", "fltt", "fltp", "fltv", "fltq", "minimum_zone")
# Columns of runs.csv that can be factors → their names in the report; text first.
SETTINGS = {
    "wrist": "wrist",
    "location": "location",
    "orientation": "orientation",
    "axial_depth_mm": "axial depth (mm)",
    "radial_depth_mm": "radial depth (mm)",
    "feed_per_tooth_mm": "feed per tooth (mm)",
    "spindle_rpm": "speed (rpm)",
    "direction": "direction",
    "feed_direction_deg": "feed direction (°)",
    "pose": "pose",
}
PLATE = "plate"  # column that says which runs share a plate


def study(batch: Batch, indices: pd.DataFrame, predicted: Mapping[str, float]) -> JSON:
    """Return the block ``study`` of identified.json: effects, ranking, and a prediction's ranking.

    Parameters
    ----------
    indices : rows of ``face_indices``: ``run, index_name, corrected_um``.
    predicted : X_m by run as a model predicts it, um; empty if nothing is predicted.
    """
    table = indices.pivot_table(index="run", columns="index_name", values="corrected_um", sort=False)
    table = table[table[PRIMARY] > 0] if PRIMARY in table else table.iloc[:0]
    runs = batch.runs.loc[[str(run) for run in table.index]]
    try:
        design = make_design(factors_of(runs))
        fitted = fit_design(design, table[PRIMARY].to_numpy(dtype=float), _plates(runs))
    except ValueError as reason:
        return {"not_identified": {"factorial": str(reason)}}
    others = {name: _refit(design, table, name, _plates(runs)) for name in OTHERS if name in table}
    known = {name: refitted for name, refitted in others.items() if refitted is not None}
    names = [str(run) for run in table.index]
    return {
        "index": "xm, noise_corrected",
        "runs": len(table),
        **described(design),
        **effects(fitted, known),
        **ranked(fitted, names, {run: predicted[run] for run in names if run in predicted}),
    }


def factors_of(runs: pd.DataFrame) -> tuple[Factor, ...]:
    """Return the factors that vary between runs (rows of the run table), by their names in the report."""
    return find_factors(
        {shown: _values(runs[column]) for column, shown in SETTINGS.items() if column in runs}
    )


def _values(column: pd.Series) -> np.ndarray:
    """Return a column as numbers if it is complete, else as text, in which a blank number is a level."""
    if pd.api.types.is_numeric_dtype(column) and column.notna().all():
        return column.to_numpy(dtype=float)
    if pd.api.types.is_numeric_dtype(column):
        return np.array([f"{value:g}" if pd.notna(value) else "blank" for value in column])
    return np.array([str(value) if value else "blank" for value in column.fillna("")])


def _plates(runs: pd.DataFrame) -> np.ndarray | None:
    known = PLATE in runs and bool((runs[PLATE].fillna("") != "").all())
    return runs[PLATE].astype(str).to_numpy() if known else None


def _refit(design: Design, table: pd.DataFrame, name: str, plates: np.ndarray | None) -> Fitted | None:
    values = table[name].to_numpy(dtype=float)
    return fit_design(design, values, plates) if (values > 0).all() else None


def described(design: Design) -> JSON:
    """Return the factors of a design, the terms that its model omits, and the confounded terms."""
    return {
        "factors": [
            {"name": factor.name, "levels": list(factor.levels), "same_as": list(factor.aliases)}
            for factor in design.factors
        ],
        "counted_as_scatter": [term_name(term) for term in design.pooled],
        "not_separable": [_alias_json(alias) for alias in design.aliases],
    }


def _alias_json(alias: Alias) -> JSON:
    return {"term": term_name(alias.term), "from": [*map(term_name, alias.same_as)], "in_part": alias.part}


def term_name(term: Term) -> str:
    """Write a main effect or an interaction."""
    return " × ".join(term)


def effects(fitted: Fitted, others: Mapping[str, Fitted], unit: str = "um") -> JSON:
    """Return the effect of each term: F and p, p of the other indices, levels as factors and in ``unit``."""
    mean, sd = float(fitted.beta[0]), math.sqrt(float(fitted.covariance[0, 0]))
    half = t_quantile(fitted.residual_dof) * sd
    size = math.exp(mean)
    block: JSON = {
        "mean": {
            "value": size,
            "ci95": [math.exp(mean - half), math.exp(mean + half)],
            "unit": unit,
        },
        "scatter": fitted.scatter,
        "dof": fitted.residual_dof,
    }
    if fitted.block_sd is not None:
        block["scatter_between_plates"] = fitted.block_sd
    adjusted = _adjusted(fitted.design, others)
    block["terms"] = [
        {"term": term_name(term), **_term_json(fitted, term, (size, unit)), "p_holm": adjusted.get(term, {})}
        for term in fitted.design.terms
    ]
    return block


def _adjusted(design: Design, others: Mapping[str, Fitted]) -> dict[Term, dict[str, float]]:
    """Return p-values of the other indices by term, adjusted over all terms of all indices."""
    keys = [(term, name) for term in design.terms for name in others]
    p = holm(np.array([f_test(others[name], term)[3] for term, name in keys])) if keys else np.zeros(0)
    result: dict[Term, dict[str, float]] = {}
    for (term, name), value in zip(keys, p, strict=True):
        if math.isfinite(value):
            result.setdefault(term, {})[name] = float(value)
    return result


def _term_json(fitted: Fitted, term: Term, mean: tuple[float, str]) -> JSON:
    f, dof, residual_dof, p = f_test(fitted, term)
    shown = contrasts(fitted, term[0]) if len(term) == 1 else level_effects(fitted, term)
    tested = {"f": f, "p_value": p} if math.isfinite(p) else {}
    return {**tested, "dof": [dof, residual_dof], "levels": [_effect_json(effect, *mean) for effect in shown]}


def _effect_json(effect: Effect, size: float, unit: str) -> JSON:
    value, low, high = effect.factor
    interval = [low, high] if math.isfinite(low) else [None, None]
    return {
        "level": list(effect.level),
        "over": effect.over,
        "factor": {"value": value, "ci95": interval, "unit": "1"},
        "difference": quantity(effect.share * size, effect.share_sd * size, unit, max(effect.dof, 1)),
    }


def ranked(fitted: Fitted, runs: Sequence[str], predicted: Mapping[str, float]) -> JSON:
    """Return the configurations from best to worst, and their ranks by a prediction of X_m (um, by run)."""
    cell, mean, covariance = cell_means(fitted)
    draws = posterior_draws(mean, covariance, fitted.residual_dof)
    best = probability_best(draws)
    half = t_quantile(fitted.residual_dof) * np.sqrt(np.diag(covariance))
    levels = [levels_of(fitted.design.factors, int(np.argmax(cell == i))) for i in range(len(mean))]
    names = [configuration(each) for each in levels]
    own = [[run for run, number in zip(runs, cell, strict=True) if number == i] for i in range(len(mean))]
    predicted_xm = predicted_means(own, predicted)
    block: JSON = {
        "ranking": [
            {
                "configuration": names[i],
                "levels": levels[i],
                "runs": own[i],
                "xm": {
                    "value": math.exp(mean[i]),
                    "ci95": [math.exp(mean[i] - half[i]), math.exp(mean[i] + half[i])],
                    "unit": "um",
                },
                "probability_best": float(best[i]),
                "xm_predicted": None if math.isnan(predicted_xm[i]) else float(predicted_xm[i]),
            }
            for i in np.argsort(mean)
        ]
    }
    both = np.isfinite(predicted_xm)
    if both.sum() > 2:
        block["agreement"] = agreement_json(agreement(predicted_xm[both], mean[both], draws[:, both]))
    return block


def predicted_means(runs: Sequence[Sequence[str]], predicted: Mapping[str, float]) -> Array:
    """Geometric mean of the predictions for the runs of each configuration; NaN without a prediction."""
    values_of = [[predicted[run] for run in own if predicted.get(run, 0.0) > 0] for own in runs]
    return np.array([math.exp(np.mean(np.log(values))) if values else math.nan for values in values_of])


def agreement_json(compared: Agreement) -> JSON:
    """Write the agreement of two rankings."""
    interval = [None, None] if compared.interval is None else list(compared.interval)
    block: JSON = {
        "spearman": {"value": compared.spearman, "ci95": interval, "unit": "1"},
        "p_value": compared.p_value,
        "pairs": compared.pairs,
        "alike": compared.alike,
    }
    if compared.sure_pairs is not None:
        block |= {"sure_pairs": compared.sure_pairs, "sure_alike": compared.sure_alike}
    return block


def levels_of(factors: Sequence[Factor], run: int) -> dict[str, str]:
    """Return the levels of the factors of the run at a place of the design."""
    return {factor.name: factor.levels[factor.code[run]] for factor in factors}


def configuration(levels: Mapping[str, str]) -> str:
    """Name a configuration by the levels of its factors, units behind the numbers."""
    parts = [(name.partition(" ("), level) for name, level in levels.items()]
    return ", ".join(f"{name} {level} {unit.rstrip(')')}".strip() for (name, _, unit), level in parts)
