"""The chain of prediction: what an observable's error owes to the predicted force, and what is its own.

With p(F) the prediction from a force F, measured less p(F predicted) is the sum of what is the observable's
own, measured less p(F measured), and of what came from upstream, p(F measured) less p(F predicted). A force
that is measured wrong moves as much from the one part to the other: the parts are only as good as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from metro.loop.fitting.fit import Fit, score
from metro.observables.problem import Block, Problem
from metro.units import JSON, Array

WHENS = ("before", "after")


@dataclass(frozen=True, eq=False)
class Parts:
    """Error of one run in the rows of the comparison, SI, (m,) each: all of it, from upstream, its own.

    ``doubt``: standard deviation of the two parts by that of the measured force.
    """

    total: Array
    upstream: Array
    own: Array
    doubt: Array


def parts(fitted: Fit, measured: Block, predicted: Block, off: Sequence[Block] = ()) -> Parts:
    """Split the error of a held-out run; the blocks are fed with the measured and with the predicted force.

    Of the run itself only its own unknowns are taken, with the measured force. ``off``: fed with forces that
    differ from the measured one by a standard deviation of each of its errors.
    """
    scored = score(fitted, [measured])
    model, nuisance = scored.candidate.model(scored.theta), scored.nuisance[measured.run]

    def prediction(block: Block) -> Array:
        matrix, offset = model.design(block, nuisance, scored.beta)
        return block.to_rows(offset + matrix @ scored.beta)

    with_measured = prediction(measured)
    own = measured.to_rows(measured.measured) - with_measured
    upstream = with_measured - prediction(predicted)
    moved = [prediction(block) - with_measured for block in off]
    return Parts(own + upstream, upstream, own, np.sqrt(np.sum(np.square([0.0 * own, *moved]), axis=0)))


def split(problem: Problem, fits: Mapping[str, Fit], fed: Mapping[str, Mapping[str, Block]]) -> JSON:
    """Return the split of an observable's error.

    Parameters
    ----------
    fits : base and final fit, by ``before`` and ``after``. fed : by held-out run, its block fed with the
        force as ``measured``, and as predicted ``before`` and ``after``; by any other name as it may be where
        what measures it is off.

    Returns
    -------
    JSON
        ``unit``; for before and after the rms ``total``, ``upstream``, ``own``, ``doubt`` (standard deviation
        of upstream and own by the measured force), and ``share``, of the mean square error that goes when the
        measured force is put in (negative: the two had made up for each other); the same by run.
    """
    result: JSON = {"unit": problem.unit, "runs": []}
    for when in WHENS:
        by_run = {run: _parts(fits[when], blocks, when) for run, blocks in fed.items()}
        result[when] = _figures(list(by_run.values()), problem.si)
        result["runs"] += [
            {"run": run, "when": when, **_figures([one], problem.si)} for run, one in by_run.items()
        ]
    return result


def _parts(fitted: Fit, blocks: Mapping[str, Block], when: str) -> Parts:
    off = [block for name, block in blocks.items() if name not in {"measured", *WHENS}]
    return parts(fitted, blocks["measured"], blocks[when], off)


def _figures(runs: Sequence[Parts], si: float) -> JSON:
    figures = {
        name: float(np.sqrt(np.mean(np.concatenate([getattr(one, name) for one in runs]) ** 2))) / si
        for name in ("total", "upstream", "own", "doubt")
    }
    total, own = figures["total"], figures["own"]
    return figures | {"share": 1.0 - (own / total) ** 2 if total > 0.0 else 0.0}
