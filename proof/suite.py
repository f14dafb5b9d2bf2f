"""The suite: which effects each batch hides, drawn by a seed, and the making of the batches."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from metro.effects.library import library
from metro.units import JSON
from proof import seal
from proof.layout import Layout
from proof.progress import tracked
from virtual_cell.blind import RECIPES

DEFAULT = "force"  # the observable of a suite that names none
# Share of the batches that hide nothing, one effect of the library, two, or one that the library lacks.
SHARES = {"none": 0.25, "one": 0.35, "two": 0.2, "outside": 0.2}
# It is wholly confounded with the coefficients of the base model, and cannot be proven in any batch.
ABSORBED = ("dynamometer_rotation",)


@dataclass(frozen=True)
class Drawn:
    """A batch to be made: its name, its kind (a key of ``SHARES``), what it hides, and its seed."""

    name: str
    kind: str
    effects: tuple[str, ...]
    seed: int


def draw(batches: int, seed: int, known: Sequence[str], unknown: Sequence[str]) -> list[Drawn]:
    """Draw what each batch hides, every effect (or pair) of its kind equally often, in random order.

    Parameters
    ----------
    known, unknown : effects that the simulator can hide and the library has, or lacks.
    """
    rng = np.random.default_rng([seed, 13])
    pairs = itertools.combinations([name for name in known if name not in ABSORBED], 2)
    choices: dict[str, list[tuple[str, ...]]] = {
        "none": [()],
        "one": [(name,) for name in known],
        "two": list(pairs),
        "outside": [(name,) for name in unknown],
    }
    ends = [round(batches * share) for share in itertools.accumulate(SHARES.values())]
    hidden: list[tuple[str, tuple[str, ...]]] = []
    for kind, first, last in zip(SHARES, [0, *ends], ends, strict=False):
        shuffled = [choices[kind][i] for i in rng.permutation(len(choices[kind]))]
        hidden += [
            (kind, effects)
            for effects, _ in zip(itertools.cycle(shuffled), range(last - first), strict=False)
        ]
    order, width = rng.permutation(batches), len(str(batches))
    return [
        Drawn(f"blind-{place:0{width}d}", hidden[i][0], hidden[i][1], 100_000 * seed + place)
        for place, i in enumerate(order, start=1)
    ]


def sides(observable: str = DEFAULT, style: str = "b") -> tuple[list[str], list[str]]:
    """Name what the simulator can hide: effects of the library; others that it lacks or only resembles."""
    inside = {effect.name for effect in library(observable) if not effect.resembled}
    names = RECIPES[observable].hides(style)
    known, unknown = ([name for name in names if (name in inside) is asked] for asked in (True, False))
    return known, unknown


def make(out: Layout, batches: int, seed: int, style: str, jobs: int, *, observable: str = DEFAULT) -> str:
    """Make the batches of a suite about an observable and seal what they hide; return the seal.

    Raises
    ------
    FileExistsError
        There are batches already.
    """
    if out.batches:
        raise FileExistsError(f"{out.raw} holds batches already: give another folder")
    drawn = draw(batches, seed, *sides(observable, style))
    out.raw.mkdir(parents=True, exist_ok=True)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        waiting = [pool.submit(_made, out, one, style, observable) for one in drawn]
        truths = dict(future.result() for future in tracked(waiting, "making batches"))
    about = {"observable": observable, "seed": seed, "style": style}
    content = {**about, "batches": {name: truths[name] for name in sorted(truths)}}
    return seal.close(content, out.truth, out.seal)


def _made(out: Layout, drawn: Drawn, style: str, observable: str) -> tuple[str, JSON]:
    made = RECIPES[observable].make
    truth = made(out.raw / drawn.name, dict.fromkeys(drawn.effects), drawn.seed, style)
    return drawn.name, {"kind": drawn.kind, **truth}
