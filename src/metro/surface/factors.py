"""The design of a factorial study: its factors, its terms, and which terms its runs confound.

Factors are Sum coded: a main effect is that over all levels of the others, whatever the order of the terms
and however uneven the repeats. Whole designs are rare in workshops: confounded terms are detected by the
rank of the design matrix, and are named instead of being fitted.

Reference: Montgomery, Design and Analysis of Experiments, ch. 5, 6 and 8.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from metro.units import Array

MOST_LEVELS = 3  # of a numeric factor that is taken level by level; with more, it is a line
LEAST_DOF = 4  # that interactions must leave for the scatter; else they are counted as scatter
TOLERANCE = 1e-8

Term = tuple[str, ...]  # names of the factors of a main effect or of an interaction


@dataclass(frozen=True, eq=False)
class Factor:
    """A setting that varies between runs.

    ``levels`` in order; ``code`` (n,) which of them each run has; ``coding`` (levels, columns): sums to zero
    over the levels; ``aliases``: settings that vary in exactly the same way, whose effect is therefore in it.
    """

    name: str
    levels: tuple[str, ...]
    code: np.ndarray
    coding: Array
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Alias:
    """A term that is not fitted, since its columns are those of other terms, wholly or in ``part``."""

    term: Term
    same_as: tuple[Term, ...]
    part: bool


@dataclass(frozen=True, eq=False)
class Design:
    """The terms that a study fits.

    Attributes
    ----------
    factors : of the design; ``terms``: names of the factors of each term, main effects first.
    matrix : (n, p), the first column ones; ``columns``: term → its columns.
    aliases : the terms that the runs confound.
    pooled : terms that are identifiable but are counted as scatter, because there are no repeats.
    """

    factors: tuple[Factor, ...]
    terms: tuple[Term, ...]
    matrix: Array
    columns: Mapping[Term, slice]
    aliases: tuple[Alias, ...]
    pooled: tuple[Term, ...]

    def factor(self, name: str) -> Factor:
        """Return the factor of a name."""
        return next(factor for factor in self.factors if factor.name == name)

    def cells(self) -> tuple[np.ndarray, Array]:
        """Return which cell (combination of levels) each run is of, (n,), and a row (cells, p) of each."""
        codes = np.column_stack([factor.code for factor in self.factors])
        _, first, cell = np.unique(codes, axis=0, return_index=True, return_inverse=True)
        return cell.ravel(), self.matrix[first]


def find_factors(settings: Mapping[str, Sequence[str] | Sequence[float] | np.ndarray]) -> tuple[Factor, ...]:
    """Return the factors of a design, settings that vary in the same way put together.

    Parameters
    ----------
    settings : name → a value per run; text, or numbers. Numbers of more than three levels become a line.
    """
    factors: list[Factor] = []
    for name, column in settings.items():
        values = np.asarray(column)
        numeric = np.issubdtype(values.dtype, np.number)
        levels, code = np.unique(values if numeric else values.astype(str), return_inverse=True)
        if len(levels) < 2:
            continue
        twin = next((i for i, other in enumerate(factors) if _same_partition(other.code, code)), None)
        if twin is not None:
            known = factors[twin]
            aliases = (*known.aliases, name)
            factors[twin] = Factor(known.name, known.levels, known.code, known.coding, aliases)
            continue
        line = numeric and len(levels) > MOST_LEVELS
        coding = _line(levels.astype(float)) if line else _sum_coding(len(levels))
        shown = tuple(f"{level:g}" if numeric else str(level) for level in levels)
        factors.append(Factor(name, shown, code, coding))
    return tuple(factors)


def _same_partition(first: np.ndarray, second: np.ndarray) -> bool:
    pairs = len(np.unique(np.column_stack([first, second]), axis=0))
    return pairs == len(np.unique(first)) == len(np.unique(second))


def _sum_coding(levels: int) -> Array:
    """Deviation of each level but the first from the mean of all; the first is what they leave."""
    return np.vstack([-np.ones(levels - 1), np.eye(levels - 1)])


def _line(levels: Array) -> Array:
    middle = (levels[0] + levels[-1]) / 2
    return np.asarray(((levels - middle) / (levels[-1] - middle))[:, None])


def make_design(factors: Sequence[Factor]) -> Design:
    """Return the main effects and all interactions that the runs identify and can afford.

    Interactions of the highest order that leaves :data:`LEAST_DOF` degrees of freedom for the scatter are
    fitted; higher ones are counted as scatter.

    Raises
    ------
    ValueError
        Where no factor varies, or the main effects leave no degree of freedom to estimate the scatter.
    """
    if not factors:
        raise ValueError("no factor varies between the runs")
    count = len(factors[0].code)
    kept, refused = _estimable(factors, count)
    limit = _affordable_order(kept, factors, count)
    terms = [term for term in kept if len(term) <= limit]
    matrix, columns = np.ones((count, 1)), {}
    for term in terms:
        block = _term_columns(term, factors)
        columns[term] = slice(matrix.shape[1], matrix.shape[1] + block.shape[1])
        matrix = np.hstack([matrix, block])
    pooled = tuple(term for term in kept if len(term) > limit)
    aliases = _without_followers([_alias(term, kept, factors) for term in refused])
    return Design(tuple(factors), tuple(terms), matrix, columns, aliases, pooled)


def _without_followers(aliases: Sequence[Alias]) -> tuple[Alias, ...]:
    """Omit interactions with a factor that follows from others: that it does is said once, of the factor."""
    follows = {alias.term[0] for alias in aliases if len(alias.term) == 1 and not alias.part}
    return tuple(a for a in aliases if len(a.term) == 1 or not follows & set(a.term))


def _estimable(factors: Sequence[Factor], count: int) -> tuple[list[Term], list[Term]]:
    """Return the terms whose columns are all new ones, one after another, and those that are not.

    Once the terms fill all cells, further ones are not looked at.
    """
    kept: list[Term] = []
    refused: list[Term] = []
    matrix = np.ones((count, 1))
    cells = len(np.unique(np.column_stack([factor.code for factor in factors]), axis=0))
    for order in range(1, len(factors) + 1):
        if matrix.shape[1] == cells and order > 2:
            break
        for names in itertools.combinations([factor.name for factor in factors], order):
            block = _term_columns(names, factors)
            if np.linalg.matrix_rank(np.hstack([matrix, block])) == matrix.shape[1] + block.shape[1]:
                kept.append(names)
                matrix = np.hstack([matrix, block])
            else:
                refused.append(names)
    return kept, refused


def _affordable_order(kept: Sequence[Term], factors: Sequence[Factor], count: int) -> int:
    for limit in range(max(map(len, kept)), 0, -1):
        used = 1 + sum(_term_columns(term, factors).shape[1] for term in kept if len(term) <= limit)
        if count - used >= (LEAST_DOF if limit > 1 else 1):
            return limit
    raise ValueError(f"{count} runs are too few for the main effects of {len(factors)} factors")


def _term_columns(term: Term, factors: Sequence[Factor]) -> Array:
    """Products of the coded columns of a term's factors, (n, columns)."""
    chosen = [factor for factor in factors if factor.name in term]
    return _products([factor.coding[factor.code] for factor in chosen])


def _products(parts: Sequence[Array]) -> Array:
    result = np.ones((len(parts[0]), 1))
    for part in parts:
        result = (result[:, :, None] * part[:, None, :]).reshape(len(part), -1)
    return result


def _alias(term: Term, kept: Sequence[Term], factors: Sequence[Factor]) -> Alias:
    """Name the terms that share columns with one that is refused."""
    blocks = [_term_columns(other, factors) for other in kept]
    own = _term_columns(term, factors)
    design = np.hstack([np.ones((len(own), 1)), *blocks])
    values = np.linalg.lstsq(design, own, rcond=None)[0]
    residual = own - design @ values
    ends = np.cumsum([1, *(block.shape[1] for block in blocks)])
    shared = [
        other
        for other, first, last in zip(kept, ends[:-1], ends[1:], strict=True)
        if np.abs(values[first:last]).max() > TOLERANCE
    ]
    return Alias(term, tuple(shared), bool(np.abs(residual).max() > TOLERANCE))
