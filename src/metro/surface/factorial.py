"""Factorial study of a positive quantity: which factors of a design move it, by how much, how surely.

The logarithm is taken of what is measured, so that effects multiply and scatter is relative. Runs count as
they are, each repeat one; plates or blocks are a random effect.

References: Montgomery, Design and Analysis of Experiments, ch. 5, 6 and 14; Holm, Scand. J. Statist. 6
(1979) 65.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from metro.surface.factors import TOLERANCE, Design, Term
from metro.units import Array


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fitted study: ``beta`` (p,) of the logarithm, its ``covariance``, ``scatter`` of one run (log).

    ``dof`` by term, of its tests; ``dof_rest`` of the scatter; ``block_sd`` (log) of the random effect of
    plates or blocks, None without.
    """

    design: Design
    beta: Array
    covariance: Array
    scatter: float
    dof: Mapping[Term, int]
    residual_dof: int
    block_sd: float | None = None


@dataclass(frozen=True)
class Effect:
    """How a level of a term lies over the mean of the design or, where ``over`` names it, another level.

    ``log`` ± ``sd`` with ``dof`` degrees of freedom; ``share`` ± ``share_sd``: the same as a difference, in
    units of the geometric mean of the design.
    """

    term: Term
    level: tuple[str, ...]
    over: str
    log: float
    sd: float
    dof: int
    share: float
    share_sd: float

    @property
    def factor(self) -> tuple[float, float, float]:
        """The factor exp(log), and its 95 % interval by Student's t."""
        half = t_quantile(self.dof) * self.sd
        return math.exp(self.log), math.exp(self.log - half), math.exp(self.log + half)

    @property
    def p_value(self) -> float:
        """Two-sided, against no difference."""
        return p_of_f((self.log / self.sd) ** 2, 1, self.dof) if self.sd > 0 else math.nan


def t_quantile(dof: float) -> float:
    """Return the 97.5 % quantile of Student's t; NaN without degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(dof, 0.975)) if dof > 0 else math.nan


def p_of_f(f: float, dof: float, residual_dof: float) -> float:
    """Upper tail of the F distribution; NaN without degrees of freedom."""
    from scipy.special import fdtrc

    return float(fdtrc(dof, residual_dof, f)) if residual_dof > 0 else math.nan


def fit_design(design: Design, values: Array, block: np.ndarray | None = None) -> Fitted:
    """Fit a design to positive ``values`` (n,); ``block`` (n,) labels the plate of each run, a random effect.

    Tests of a term that is constant within plates have the plates' degrees of freedom, all others those that
    are left within plates (containment). Without a block, least squares.

    Raises
    ------
    ValueError
        Where a value is not positive.
    """
    if not (np.asarray(values) > 0).all():
        raise ValueError("a factorial study on a log scale needs positive values")
    y, x = np.log(values), design.matrix
    residual_dof = len(y) - x.shape[1]
    if block is None or not 1 < len(np.unique(block)) < len(block):
        inverse = np.linalg.inv(x.T @ x)
        beta = inverse @ x.T @ y
        variance = float(np.sum((y - x @ beta) ** 2)) / residual_dof
        dof = dict.fromkeys(design.terms, residual_dof)
        return Fitted(design, beta, variance * inverse, math.sqrt(variance), dof, residual_dof)
    return _mixed(design, y, block)


def _mixed(design: Design, y: Array, block: np.ndarray) -> Fitted:
    """Restricted maximum likelihood with a random intercept of each plate."""
    from statsmodels.regression.mixed_linear_model import MixedLM

    x, p = design.matrix, design.matrix.shape[1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance between plates of zero is an answer, not a failure
        model = MixedLM(y, x, groups=block).fit(reml=True)
    between, scale = float(model.cov_re[0, 0]), float(model.scale)
    if not (math.isfinite(between) and math.isfinite(scale) and scale > 0):
        raise ValueError("the scatter between plates cannot be separated from that within them")
    labels = np.unique(block, return_inverse=True)[1]
    plates = np.eye(labels.max() + 1)[labels]
    weight = np.linalg.inv(scale * np.eye(len(y)) + between * plates @ plates.T)
    covariance = np.asarray(np.linalg.inv(x.T @ weight @ x), dtype=np.float64)
    within = len(y) - int(np.linalg.matrix_rank(np.hstack([x, plates])))
    mean = plates / plates.sum(axis=0)
    constant = [bool(np.abs(x[:, i] - plates @ (mean.T @ x[:, i])).max() < TOLERANCE) for i in range(p)]
    among = plates.shape[1] - int(np.linalg.matrix_rank(x[:, constant]))
    dof = {term: (among if all(constant[place]) else within) for term, place in design.columns.items()}
    return Fitted(
        design, covariance @ x.T @ weight @ y, covariance, math.sqrt(scale), dof, within, math.sqrt(between)
    )


def f_test(fitted: Fitted, term: Term) -> tuple[float, int, int, float]:
    """Return F, its degrees of freedom and p of a term, all others in the model (type III)."""
    place = fitted.design.columns[term]
    beta, covariance = fitted.beta[place], fitted.covariance[place, place]
    f = float(beta @ np.linalg.solve(covariance, beta)) / len(beta)
    return f, len(beta), fitted.dof[term], p_of_f(f, len(beta), fitted.dof[term])


def level_effects(fitted: Fitted, term: Term) -> list[Effect]:
    """Return how each (combination of) level(s) of a term lies over the prediction of the terms within it.

    For a main effect that is the geometric mean over the design, each level of every factor counting once.
    """
    rows, levels = _level_rows(fitted.design, term)
    logs = rows @ fitted.beta
    covariance = rows @ fitted.covariance @ rows.T
    sds = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return [
        Effect(term, level, "mean", float(a), float(sd), fitted.dof[term], *_difference(a, 0.0, sd, 0.0, 0.0))
        for level, a, sd in zip(levels, logs, sds, strict=True)
    ]


def contrasts(fitted: Fitted, name: str) -> list[Effect]:
    """Return how each level of a factor but the first lies over the first, the others averaged over."""
    term = (name,)
    rows, levels = _level_rows(fitted.design, term)
    logs, covariance = rows @ fitted.beta, rows @ fitted.covariance @ rows.T
    result = []
    for i in range(1, len(levels)):
        variances = covariance[i, i], covariance[0, 0], covariance[i, 0]
        sd = math.sqrt(max(variances[0] + variances[1] - 2 * variances[2], 0.0))
        sds = [math.sqrt(max(variance, 0.0)) for variance in variances[:2]]
        shares = _difference(logs[i], logs[0], sds[0], sds[1], variances[2])
        result.append(
            Effect(term, levels[i], levels[0][0], float(logs[i] - logs[0]), sd, fitted.dof[term], *shares)
        )
    return result


def _difference(a: float, b: float, sd_a: float, sd_b: float, shared: float) -> tuple[float, float]:
    """exp(a) − exp(b) and its standard deviation to first order; ``shared``: covariance of a and b."""
    high, low = math.exp(a), math.exp(b)
    variance = (high * sd_a) ** 2 + (low * sd_b) ** 2 - 2 * high * low * shared
    return high - low, math.sqrt(max(float(variance), 0.0))


def _level_rows(design: Design, term: Term) -> tuple[Array, list[tuple[str, ...]]]:
    """Rows (levels, p) that pick a term's own part out of ``beta``, and the levels they are of."""
    factors = [design.factor(name) for name in term]
    own = np.ones((1, 1))
    for factor in factors:
        own = np.asarray(np.kron(own, factor.coding), dtype=np.float64)
    rows = np.zeros((len(own), design.matrix.shape[1]))
    rows[:, design.columns[term]] = own
    return rows, list(itertools.product(*(factor.levels for factor in factors)))


def cell_means(fitted: Fitted) -> tuple[np.ndarray, Array, Array]:
    """Return each run's cell (n,), and the cells' means (log) with their covariance as fitted."""
    cell, rows = fitted.design.cells()
    return cell, rows @ fitted.beta, rows @ fitted.covariance @ rows.T


def holm(p_values: Array) -> Array:
    """Adjust p-values for their number so that the chance of any false one stays at the level (Holm)."""
    from statsmodels.stats.multitest import multipletests

    result = np.array(p_values, dtype=float)
    known = np.isfinite(result)
    if known.any():
        result[known] = multipletests(result[known], method="holm")[1]
    return result
