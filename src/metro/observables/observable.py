"""What computes an observable: from raw tables to a problem, and from a fit to identified quantities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.problem import BaseFit, Problem, Refusal
from metro.units import JSON

Observed = Mapping[str, pd.DataFrame]
Posed = TypeVar("Posed")  # the kind of problem that an observable poses: of samples, or of labels


@dataclass(frozen=True)
class Observable(Generic[Posed]):
    """A kind of measurement that a model predicts.

    Attributes
    ----------
    name : the contract's. tables : names of the observed tables that it may write.
    observe : ``observe(batch, read, identified)`` makes compact observed tables, by name, from the canonical
        ones; this is the heavy part. ``identified`` is the content of identified.json as far as it is known.
    problem : ``problem(batch, observed, identified)`` makes blocks and a base model from the observed tables.
    report : ``report(batch, observed, identified, task, fit)`` writes blocks of identified.json, to be
        merged; ``fit`` is None where there was nothing to fit.
    beside : ``beside(batch, read, identified)`` gives further tables, and blocks of identified.json, that
        need all that was identified and are compared with nothing. None: there are none.
    gives_coefficients : whether its report holds the cutting coefficients, which others start from.
    observed_with_coefficients : whether the observed tables depend on the cutting coefficients, so that they
        are made anew where an effect changed these.
    reported_without_fit : whether ``report`` has something to say where nothing was fitted.
    retold : whether ``report`` is written again with the model and the fit of proven effects: what the base
        model identified without them is wrong by what they are.
    after_loop : ``after_loop(batch, observed, identified, problem, fit)`` writes the blocks that follow from
        the model with the effects found, which ``problem`` has as its base. None: nothing follows.
    """

    name: str
    tables: tuple[str, ...]
    observe: Callable[[Batch, Tables, JSON], dict[str, pd.DataFrame] | Refusal]
    problem: Callable[[Batch, Observed, JSON], Posed | Refusal]
    report: Callable[[Batch, Observed, JSON, Posed | Refusal, BaseFit | None], JSON]
    beside: Callable[[Batch, Tables, JSON], tuple[dict[str, pd.DataFrame], JSON]] | None = None
    gives_coefficients: bool = False
    observed_with_coefficients: bool = False
    reported_without_fit: bool = False
    retold: bool = False
    after_loop: Callable[[Batch, Observed, JSON, Problem, BaseFit], JSON] | None = None
