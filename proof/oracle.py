"""The oracle: what a fit that knows the true effects reaches, and how large each of them is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from metro.effects.effect import Effect, fitted_to
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit, score
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.noise import diagonal, first_noise, shared, whitener
from metro.observables.problem import Problem
from metro.units import JSON
from proof.score import forms, joint

LEAST_GAIN = 2.0  # log-likelihood per effect: with less the runs of the fit do not identify it


def oracle(
    task: Problem,
    hidden: Mapping[str, JSON],
    effects: Sequence[Effect],
    budget: float,
    also: Mapping[str, JSON | list[JSON]] | None = None,
) -> JSON:
    """Fit base and true effects to the identification runs; judge them on the held-out ones.

    Effects that leave those runs as likely as they are without any keep their true parameters: a fit would
    let them go anywhere, which the held-out runs need not forgive.

    Parameters
    ----------
    hidden : true effects and their parameters, as in the contract's table.
    effects : the library.
    budget : relative model-form budget.
    also : what a cell always has a little of, in one joint or in several: it is fitted beside the hidden
        effects, and its size not asked. What only resembles an effect of the library is not: no fit can part
        the two.

    Returns
    -------
    ``before`` and ``after`` (rms error on the held-out runs without and with the effects), ``floor`` (rms of
    the noise there, without the uncertainty of base parameters) and ``sizes``: of each effect, how much the
    prediction changes when it is left out and all else is refitted, over the floor, or over the noise beside
    what whole runs share, whichever is larger. Where the library lacks
    one of them: ``after`` is None, the floor that of the declared noise (the fitted one has swallowed some of
    the effect), and the size the error beyond noise and uncertainty of base parameters, over the floor.
    """
    blocks = task.role("identify", "calibrate")
    prior = first_noise(budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    able, _ = fitted_to(tuple(effects), task)
    known = [_at_truth(able, name, values) for name, values in hidden.items()]
    acting = [effect for effect in known if effect is not None]
    sure = [effect for effect in able if not effect.resembled]
    beside = [_at_truth(sure, name, one) for name, values in (also or {}).items() for one in forms(values)]
    always = [effect for effect in beside if effect is not None]

    def fitted(chosen: list[Effect]) -> Fit:
        whole = (*chosen, *always)
        return fit(Candidate(task.base, whole), blocks, prior, base) if whole else base

    if len(acting) < len(hidden):
        without = replace(fitted([]), noise=prior)
        rows = _rows(task, base, without)
        left, expected = _rms(rows["measured"] - rows["after"]), _rms(rows["sigma"])
        floor = _rms(_rows(_all_identified(task), base, without)["sigma"])
        size = float(np.sqrt(max(0.0, left**2 - expected**2))) / floor
        before = _rms(rows["measured"] - rows["before"])
        return {"before": before, "after": None, "floor": floor, "sizes": dict.fromkeys(hidden, size)}

    full = fitted(acting)
    if full.total - base.total < LEAST_GAIN * (len(acting) + len(always)):
        acting, always = ([_kept(effect) for effect in some] for some in (acting, always))
        full = fitted(acting)
    rows = _rows(task, base, full)
    floor = _rms(_rows(_all_identified(task), base, full)["sigma"])
    sizes = {}
    for effect in acting:
        without = fitted([other for other in acting if other is not effect])
        lacking = _rows(task, without, full)
        change = _rms(lacking["after"] - lacking["before"]) / floor
        sizes[effect.name] = max(change, _change_of_form(task, without, full))
    return {
        "before": _rms(rows["measured"] - rows["before"]),
        "after": _rms(rows["measured"] - rows["after"]),
        "floor": floor,
        "sizes": sizes,
    }


def _change_of_form(task: Problem, lacking: Fit, full: Fit) -> float:
    """Rms change of the held-out elements by an effect over their noise, beside what a whole run shares.

    The height and tilt of a face on an unknown place, zeros and scatter of coefficients are noise in those
    directions alone: a form of 10 µm is seen on a face whose height is known to 90 µm.
    """
    blocks = _all_identified(task).role("validate")
    total, count = 0.0, 0
    one, other = (score(fitted, blocks) for fitted in (lacking, full))
    for block in blocks:
        matrix, _ = full.candidate.model(full.theta).design(block, other.nuisance[block.run], full.beta)
        whiten = whitener(
            diagonal(block, full.noise.alone(block)), shared(block, full.noise, matrix, full.beta)
        )
        change = whiten(other.predict(block) - one.predict(block))
        total, count = total + float(change @ change), count + len(change)
    return float(np.sqrt(total / count))


def _kept(effect: Effect) -> Effect:
    """Return an effect whose parameters are kept at their start values: no run identifies them."""
    kept = tuple(replace(p, lower=p.starts[0], upper=p.starts[0]) for p in effect.parameters)
    return replace(effect, parameters=kept)


def _all_identified(task: Problem) -> Problem:
    """Take the parameters of the base model of the force as identified by the runs: the residual is noise.

    What is not identified of a wall is the error of its force, which is noise of an instrument.
    """
    if task.observable != "force":
        return task
    return replace(task, blocks=tuple(replace(block, unidentified=None) for block in task.blocks))


def _at_truth(able: Sequence[Effect], name: str, values: JSON) -> Effect | None:
    """Return an effect that starts from its true parameters; None where the library lacks it.

    Of an effect of one joint it is the form of that joint. The truth may have more parameters than the effect
    (a phase that is another unknown of every run).
    """
    for effect in able:
        if effect.name == name and set(effect.names) <= set(values) and joint(effect.where) == joint(values):
            theta = np.linalg.lstsq(effect.matrix, _flat(effect, values), rcond=None)[0]
            started = zip(effect.parameters, theta.tolist(), strict=True)
            return replace(
                effect, parameters=tuple(replace(p, starts=(value,), group=0) for p, value in started)
            )
    return None


def _flat(effect: Effect, values: Mapping[str, Any]) -> list[float]:
    """Return the values in the order in which the effect has them; those of one name are a list."""
    left = {name: iter(np.atleast_1d(value).tolist()) for name, value in values.items()}
    return [next(left[parameter.name]) for parameter in effect.reported]


def _rows(task: Problem, before: Fit, after: Fit) -> pd.DataFrame:
    return comparison(task, held_out(task, before), held_out(task, after))


def _rms(values: pd.Series[float]) -> float:
    return float(np.sqrt((values**2).mean()))
