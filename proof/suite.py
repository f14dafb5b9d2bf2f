"""The suite: which effects each batch hides, drawn by a seed, and the making of the batches."""

from __future__ import annotations

import itertools
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context

import numpy as np

from metro.batch.processed import write_json
from metro.effects.library import library
from proof import seal
from proof.layout import Layout
from proof.progress import tracked
from virtual_cell.blind import RECIPES

DEFAULT = "force"  # the observable of a suite that names none
FULL = 150  # batches of a suite that is judged
# Share of the batches that hide nothing, one effect of the library, two, or one that the library lacks, by
# style. Of a full suite in the harder world 30 hide nothing, 68 one effect (of which 60 % are visible: 40),
# 20 two and 32 something outside.
_IDEAL = {"none": 0.25, "one": 0.35, "two": 0.2, "outside": 0.2}
_HARDER = {kind: count / FULL for kind, count in (("none", 30), ("one", 68), ("two", 20), ("outside", 32))}
SHARES = {"a": _IDEAL, "b": _IDEAL, "c": _HARDER, "d": _HARDER}
# It is wholly confounded with the coefficients of the base model, and cannot be proven in any batch.
ABSORBED = ("dynamometer_rotation",)


@dataclass(frozen=True)
class Suite:
    """What batches are about: an observable, how many, the seed of all draws, the style of the world.

    ``commit``: whose code is under test; empty where no commit is judged.
    """

    observable: str
    batches: int
    seed: int
    style: str
    commit: str = ""


@dataclass(frozen=True)
class Drawn:
    """A batch to be made: its name, its kind (a key of the shares), what it hides, and its seed."""

    name: str
    kind: str
    effects: tuple[str, ...]
    seed: int


def draw(
    batches: int, seed: int, known: Sequence[str], unknown: Sequence[str], shares: Mapping[str, float]
) -> list[Drawn]:
    """Draw what each batch hides, every effect (or pair) of its kind equally often, in random order.

    Parameters
    ----------
    known, unknown : effects that the simulator can hide and the library has, or lacks.
    shares : of the batches, by kind.
    """
    rng = np.random.default_rng([seed, 13])
    pairs = itertools.combinations([name for name in known if name not in ABSORBED], 2)
    choices: dict[str, list[tuple[str, ...]]] = {
        "none": [()],
        "one": [(name,) for name in known],
        "two": list(pairs),
        "outside": [(name,) for name in unknown],
    }
    ends = [round(batches * share) for share in itertools.accumulate(shares.values())]
    hidden: list[tuple[str, tuple[str, ...]]] = []
    for kind, first, last in zip(shares, [0, *ends], ends, strict=False):
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


def make(out: Layout, suite: Suite, jobs: int) -> str:
    """Make the batches of a suite and seal what they hide; return the seal.

    Batches that were made before an interruption are kept.

    Raises
    ------
    FileExistsError
        The suite is sealed already, or the folder holds batches of another one.
    """
    _begun(out, suite)
    drawn = draw(suite.batches, suite.seed, *sides(suite.observable, suite.style), SHARES[suite.style])
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        missing = [one for one in drawn if not out.made(one.name).is_file()]
        waiting = [pool.submit(_made, out, one, suite.style, suite.observable) for one in missing]
        for future in tracked(waiting, "making batches"):
            future.result()
    truths = {one.name: json.loads(out.made(one.name).read_text()) for one in drawn}
    return seal.close({**asdict(suite), "batches": dict(sorted(truths.items()))}, out.truth, out.seal)


def _begun(out: Layout, suite: Suite) -> None:
    """Write down what the suite is, unless it was begun before."""
    content = asdict(suite)
    same = out.suite.is_file() and json.loads(out.suite.read_text()) == content
    if out.seal.is_file() or (out.batches and not same):
        raise FileExistsError(f"{out.raw} holds batches already: give another folder")
    write_json(out.suite, content)


def _made(out: Layout, drawn: Drawn, style: str, observable: str) -> None:
    """Make a batch; what is left of an interrupted one goes."""
    folder = out.raw / drawn.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    try:
        truth = RECIPES[observable].make(folder, dict.fromkeys(drawn.effects), drawn.seed, style)
    except Exception as error:
        what = f"{drawn.name}, style {style}, seed {drawn.seed}, hiding {drawn.effects or 'nothing'}"
        raise RuntimeError(f"the {observable} recipe failed: {what}") from error
    write_json(out.made(drawn.name), {"kind": drawn.kind, **truth})
