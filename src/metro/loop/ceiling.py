"""How much of what the base model leaves could be explained by any cause, and how that changes with the cut.

The residuals of the runs are laid over one another. Each harmonic of them is taken as a sum of what is the
same in every run, of what is proportional to a circumstance (feed, depth, …), and of what does not repeat:
random amplitudes, whose variances all harmonics share and maximum likelihood finds. With these variances any
condition is predicted from the others; what that explains is a ceiling for causes, whatever they are, and the
variances say which kind of cause is missing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from metro.loop.fitting.fit import Fit, score
from metro.loop.statement import Statement
from metro.observables.problem import Block, Overlaid, Problem
from metro.units import JSON, Array, ComplexArray

SAME, ALONE = "same", "alone"  # the same in every run; of one run alone, so that it does not repeat
VARIES = 1e-3  # relative range of a circumstance that is more than its rounding
LEAST_CONDITIONS = 3  # two are predicted from one each, which shows no change with a circumstance
STEPS, SETTLED = 2000, 1e-5  # of expectation and maximisation; least change, relative to the power
MOST_PLACES = 6  # that are named
CARRIED = 0.8  # share of the explained power that these carry at most


@dataclass(frozen=True, eq=False)
class Run:
    """A run, laid over the others.

    Attributes
    ----------
    residual : (channels, harmonics) that the base model leaves, SI. noise : its power by noise alone.
    signal : power of what was measured. circumstances : settings of the run, SI.
    shift : of the angle of the first tooth, rad, by which it was chosen.
    """

    name: str
    condition: str
    residual: ComplexArray
    noise: float
    signal: float
    circumstances: Mapping[str, float]
    shift: float = 0.0


@dataclass(frozen=True, eq=False)
class Pattern:
    """How the residual of conditions changes with their circumstances.

    Attributes
    ----------
    terms : what its parts are proportional to, ``SAME`` among them. variance : (terms,) of their amplitudes,
        for circumstances relative to their root mean square ``scale`` (terms,). alone : of what does not
        repeat. factors : (conditions, terms) of the conditions. residuals : (conditions, channels,
        harmonics) of them, SI.
    """

    terms: tuple[str, ...]
    scale: Array
    variance: Array
    alone: float
    factors: Array
    residuals: ComplexArray

    def predicted(self, settings: Mapping[str, float]) -> ComplexArray:
        """Predict the residual (channels, harmonics) of a run that is none of the conditions."""
        here = _factors(self.terms, settings) / self.scale
        covariance = (self.factors * self.variance) @ self.factors.T + self.alone * np.eye(len(self.factors))
        weights = np.linalg.solve(covariance, (self.factors * self.variance) @ here)
        return np.asarray(np.tensordot(weights, self.residuals, axes=1))


def ceiling(problem: Problem, base: Fit) -> JSON | None:
    """Return the ceiling of an observable's residual; None where its runs cannot be laid over one another.

    Returns
    -------
    JSON
        ``parts`` of the residual's power, by what they are proportional to, ``alone`` being what does not
        repeat; ``share`` of it that is predicted of conditions left out, with ``ci95`` by the conditions;
        ``noise_share`` that noise makes; ``places`` at which it is largest, with their shares; ``held_out``:
        of each run that verifies, the ``share`` predicted and the residual relative to the signal;
        ``words``: all that as a statement.
    """
    if not isinstance(problem.base, Overlaid):
        return None
    runs = _overlaid(problem.base, base, problem.role("identify"))
    if len({run.condition for run in runs}) < LEAST_CONDITIONS:
        return None
    pattern, held = _pattern(runs), problem.role("validate")
    unseen = _overlaid(problem.base, score(base, held), held, pattern) if held else []
    share, ci95 = _unseen_share(runs)
    power = sum(_power(run.residual) for run in runs)
    entry: JSON = {
        "parts": _parts(pattern),
        "share": share,
        "ci95": ci95,
        "noise_share": min(1.0, sum(run.noise for run in runs) / power),
        "places": _places(problem.base, runs),
        "held_out": [_left(run, pattern) for run in unseen if run.signal],
    }
    return entry | {"words": Statement("ceiling", entry)}


def aligned(problem: Problem, fitted: Fit) -> dict[str, Array]:
    """Return the unknowns of the runs of a fit, the first tooth of each chosen so that residuals agree."""
    if not isinstance(problem.base, Overlaid):
        return dict(fitted.nuisance)
    runs = _overlaid(problem.base, fitted, [block for block in fitted.blocks if block.role != "calibrate"])
    return {**fitted.nuisance, **{run.name: _turned(fitted.nuisance[run.name], run.shift) for run in runs}}


def _turned(nuisance: Array, shift: float) -> Array:
    """Return the unknowns of a run with another tooth as the first one: their first one is its angle."""
    return np.concatenate([nuisance[:1] + shift, nuisance[1:]])


def _overlaid(
    model: Overlaid,
    fitted: Fit,
    blocks: Sequence[Block],
    like: Pattern | None = None,
) -> list[Run]:
    """Lay the residuals of blocks over one another, or over what a pattern predicts of them.

    The base model does not know which tooth is the first one. It is chosen so that residuals agree.
    """
    runs: list[Run] = []
    based = fitted.candidate.model(fitted.theta)
    for block in blocks:
        nuisance = fitted.nuisance[block.run]
        matrix, offset = based.design(block, nuisance, fitted.beta)
        residual = block.measured - offset - matrix @ fitted.beta
        shifts = np.zeros((1, len(nuisance))) if block.symmetries is None else block.symmetries
        images = [model.overlaid(block, nuisance + shift, residual) for shift in shifts]
        if not images[0].size:
            continue
        settings = model.circumstances(block)
        if like:
            wanted = like.predicted(settings)
        else:
            wanted = np.zeros_like(images[0])
            for run in runs:
                wanted += run.residual / math.sqrt(_power(run.residual))
        agreement = [float(np.sum(image * np.conj(wanted)).real) for image in images]
        best = int(np.argmax(agreement))
        runs.append(
            Run(
                name=block.run,
                condition=block.condition,
                residual=images[best],
                noise=float(np.sum(block.error**2)) / block.repeats**2,
                signal=float(np.sum(block.measured**2)) / block.repeats,
                circumstances=settings,
                shift=float(shifts[best, 0]) if shifts.size else 0.0,
            )
        )
    return runs


def _pattern(runs: Sequence[Run]) -> Pattern:
    """Find the variances of the parts of the residual; runs of a condition are one piece of evidence."""
    conditions = sorted({run.condition for run in runs})
    members = [[run for run in runs if run.condition == name] for name in conditions]
    residuals = np.array([np.mean([run.residual for run in each], axis=0) for each in members])
    varying = [name for name in runs[0].circumstances if _varies([run.circumstances[name] for run in runs])]
    terms = (SAME, *varying)
    factors = np.array(
        [np.mean([_factors(terms, run.circumstances) for run in each], axis=0) for each in members]
    )
    scale = np.sqrt(np.mean(factors**2, axis=0))
    flat = residuals.reshape(len(residuals), -1)
    seen = (flat @ flat.conj().T).real / flat.shape[1]
    variance, alone = _variances(factors / scale, seen)
    return Pattern(terms, scale, variance, alone, factors / scale, residuals)


def _variances(factors: Array, seen: Array) -> tuple[Array, float]:
    """Variances (terms,), and of what does not repeat, that a covariance ``seen`` (n, n) is most likely with.

    By expectation and maximisation (Dempster, Laird and Rubin, J. R. Stat. Soc. B 39 (1977) 1), which keeps
    them above zero.
    """
    count, terms = factors.shape
    power = float(np.trace(seen)) / count
    variance, alone = np.full(terms, power / (terms + 1)), power / (terms + 1)
    for _ in range(STEPS):
        inverse = np.linalg.inv((factors * variance) @ factors.T + alone * np.eye(count))
        gain = inverse @ seen @ inverse - inverse
        change = variance**2 * np.sum(factors * (gain @ factors), axis=0)
        own = alone**2 * float(np.trace(gain)) / count
        variance, alone = variance + change, alone + own
        if max(np.abs(change).max(), abs(own)) < SETTLED * power:
            break
    return variance, alone


def _varies(values: Sequence[float]) -> bool:
    return bool(np.all(np.isfinite(values)) and np.ptp(values) > VARIES * np.abs(values).max())


def _factors(terms: tuple[str, ...], settings: Mapping[str, float]) -> Array:
    return np.array([1.0 if term == SAME else settings[term] for term in terms])


def _unseen_share(runs: Sequence[Run]) -> tuple[float, list[float]]:
    """Share of the residual's power predicted of conditions left out in turn; interval by jackknife."""
    from scipy.stats import t

    conditions = sorted({run.condition for run in runs})
    left, whole = np.zeros(len(conditions)), np.zeros(len(conditions))
    for i, condition in enumerate(conditions):
        pattern = _pattern([run for run in runs if run.condition != condition])
        out = [run for run in runs if run.condition == condition]
        left[i] = np.mean([_power(run.residual - pattern.predicted(run.circumstances)) for run in out])
        whole[i] = np.mean([_power(run.residual) for run in out])
    count, share = len(conditions), 1.0 - left.sum() / whole.sum()
    shares = 1.0 - (left.sum() - left) / (whole.sum() - whole)
    error = math.sqrt((count - 1) / count * float(np.sum((shares - shares.mean()) ** 2)))
    half = float(t.ppf(0.975, count - 1)) * error
    return share, [share - half, min(share + half, 1.0)]


def _parts(pattern: Pattern) -> JSON:
    """Share of the residual's power in each part, the largest first, and in what does not repeat."""
    whole = pattern.variance.sum() + pattern.alone
    shares = dict(zip(pattern.terms, (pattern.variance / whole).tolist(), strict=True))
    return dict(sorted(shares.items(), key=lambda one: -one[1])) | {ALONE: float(pattern.alone / whole)}


def _power(values: ComplexArray) -> float:
    return float(np.sum(np.abs(values) ** 2))


def _places(model: Overlaid, runs: Sequence[Run]) -> list[JSON]:
    """Name the places that carry most of the residual's power, the largest first."""
    power = np.sum([np.abs(run.residual) ** 2 for run in runs], axis=0)
    shares = (power / power.sum()).ravel()
    order = np.argsort(shares)[::-1][:MOST_PLACES]
    kept = order[: int(np.searchsorted(np.cumsum(shares[order]), CARRIED)) + 1]
    places = [(float(shares[at]), *model.place(*map(int, np.unravel_index(at, power.shape)))) for at in kept]
    return [{"axis": axis, "label": label, "share": share} for share, axis, label in places]


def _left(run: Run, pattern: Pattern) -> JSON:
    """Return what a pattern explains of a run, and what it leaves of the signal."""
    left = _power(run.residual - pattern.predicted(run.circumstances))
    share = 1.0 - left / _power(run.residual)
    return {"run": run.name, "share": share, "of_signal": math.sqrt(left / run.signal)}
