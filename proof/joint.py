"""What do all observables show together? Joint batches, the causes named against those named by each alone.

Each batch has force, torques, walls and faces of one arm, and hides nothing, one cause that shows in one or
two of them, or a stiffness that is another one in the walls than in the faces, which is not one cause. The
same run of the pipeline gives both: the verdict of an observable uses no other, the causes of the batch are
those of all. The truth of every force gives the part of a wall's or a face's error that came with it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from metro.units import JSON
from proof.layout import Layout
from proof.run import run
from proof.split import Fed, fed, split_figures
from proof.statistics import Demand, Figure, share
from proof.tables import Table, tabulated
from virtual_cell.hidden import Parameters
from virtual_cell.recipes.joint import SHOWN, make

CONTRADICTION = "contradiction"
KINDS = (
    *("stiffness_scale", "none", "tool_offset_error", CONTRADICTION),
    *("friction_reversal", "gear_ripple", "stiffness_scale", "tool_runout"),
)
STYLE = "b"
ADDED, WRONG, INSIDE = Demand(most=0.02), Demand(most=0.05), Demand(0.9)
Key = tuple[str, str]  # a cause and its joint


@dataclass(frozen=True)
class Attributed:
    """A batch, what it hides, and what was named.

    Attributes
    ----------
    kind : of ``KINDS``. hidden : cause and joint, None: nothing. alone : by observable, the causes that its
        own verdict names. together : the causes of the batch, and their status. held : by shared parameter,
        whether the interval of all together holds the truth. fed : of its held-out runs, what came with the
        force.
    """

    name: str
    kind: str
    hidden: Key | None
    alone: dict[str, tuple[Key, ...]]
    together: dict[Key, str]
    held: tuple[bool, ...]
    fed: tuple[Fed, ...]

    @property
    def named(self) -> bool:
        """Whether all together name what is hidden: as a contradiction where it is one, and only there."""
        if self.hidden not in self.together:
            return False
        return (self.together[self.hidden] == CONTRADICTION) is (self.kind == CONTRADICTION)

    @property
    def others(self) -> list[Key]:
        """Causes that all together name and that are not hidden."""
        return [key for key in self.together if key != self.hidden]

    def by(self, observable: str) -> bool:
        """Whether an observable alone names what is hidden, and nothing else."""
        return set(self.alone.get(observable, ())) == {self.hidden}


def attributed(out: Layout, batches: int, seed: int, jobs: int) -> list[Attributed]:
    """Make joint batches, run the pipeline on them, and compare what is named; goes on where it was stopped.

    Raises
    ------
    RuntimeError
        The pipeline failed on a batch; the reason is in its ``failed.txt``.
    """
    out.raw.mkdir(parents=True, exist_ok=True)
    out.truth.parent.mkdir(exist_ok=True)
    for place in range(batches):
        name, each = f"joint-{place:03d}", 100_000 * seed + place
        if not _truth(out, name).is_file():
            kind = KINDS[place % len(KINDS)]
            truth = make(out.raw / name, hidden_of(kind, each), each, STYLE)
            _truth(out, name).write_text(json.dumps({"kind": kind, **truth}, indent=1) + "\n")
    failed = run(out, jobs, keep=False, pdf=False)
    if failed:
        raise RuntimeError(f"failed, see failed.txt in {out.reports}: {', '.join(failed)}")
    return [_attributed(out, name) for name in out.batches]


def hidden_of(kind: str, seed: int) -> dict[str, Parameters | None]:
    """Return what a batch of a kind hides; of a contradiction, stiffness errors of opposite signs."""
    if kind != CONTRADICTION:
        return {} if kind == "none" else {kind: None}
    rng = np.random.default_rng([seed, 61])
    walls, of_faces = np.exp(rng.choice([-1.0, 1.0]) * np.array([1.0, -1.0]) * rng.uniform(0.1, 0.3, 2))
    factors = {"factor": round(float(walls), 3), "factor_of_faces": round(float(of_faces), 3)}
    return {"stiffness_scale": {**factors, "joint": "all"}}


def _truth(out: Layout, name: str) -> Path:
    return out.truth.parent / f"{name}.json"


def _attributed(out: Layout, name: str) -> Attributed:
    truth, verdict = (_read(path) for path in (_truth(out, name), out.reports / name / "verdict.json"))
    return Attributed(
        name,
        truth["kind"],
        hidden=next((_key(cause, values) for cause, values in truth["effects"].items()), None),
        alone={
            observable: tuple(_key(e["effect"], e["parameters"]) for e in entry.get("effects") or [])
            for observable, entry in verdict["observables"].items()
        },
        together={_key(cause["cause"], cause["where"]): cause["status"] for cause in verdict["causes"]},
        held=_held(truth["effects"], verdict["causes"]),
        fed=fed(out.processed / name, truth["runs"]),
    )


def _read(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text())
    return content


def _key(cause: str, values: JSON) -> Key:
    return cause, str(values.get("joint", "all"))


def _held(truth: JSON, causes: Sequence[JSON]) -> tuple[bool, ...]:
    """Whether the intervals of the hidden cause's parameters, as all together give them, hold the truth.

    An angle is identifiable only up to the pitch, and is left out.
    """
    covered = []
    for cause in causes:
        values = truth.get(cause["cause"]) or {}
        if values and _key(cause["cause"], cause["where"]) == _key(cause["cause"], values):
            for name, quantity in cause["parameters"].items():
                if name in values and "_deg" not in name and None not in (quantity["ci95"] or [None]):
                    low, high = quantity["ci95"]
                    covered.append(bool(low <= values[name] <= high))
    return tuple(covered)


def figures(batches: Sequence[Attributed]) -> list[Figure]:
    """Return how often all together are right and how often each alone, and what is demanded."""
    none = [one for one in batches if one.kind == "none"]
    torn = [one for one in batches if one.kind == CONTRADICTION]
    one_cause = [one for one in batches if one not in none and one not in torn]
    several = [one for one in one_cause if len(SHOWN[one.kind]) > 1]
    alone = [
        share(f"shows in {name}: named by it alone", [one.by(name) for one in shown])
        for name in sorted({name for one in one_cause for name in SHOWN[one.kind]})
        if (shown := [one for one in one_cause if name in SHOWN[one.kind]])
    ]
    return [
        share("nothing hidden: a cause is added", [bool(one.together) for one in none], ADDED),
        share(
            "one cause: another one is named by all together", [bool(one.others) for one in one_cause], WRONG
        ),
        share("one cause: named by all together", [one.named for one in one_cause]),
        share(
            "one cause that shows in two: named by all together, and nothing else",
            [one.named and not one.others for one in several],
        ),
        share(
            "the same: named by the better one of the two alone, and nothing else",
            [any(one.by(name) for name in SHOWN[one.kind]) for one in several],
        ),
        *alone,
        share("a stiffness that differs: said to be a contradiction", [one.named for one in torn]),
        share("parameters of all together that hold the truth", [h for o in batches for h in o.held], INSIDE),
        *split_figures([each for one in batches for each in one.fed]),
    ]


def tables(batches: Sequence[Attributed]) -> list[Table]:
    """Return the figures, and the batches one by one."""
    note = f"{len(batches)} batches; the sizes of what is hidden reach below what can be seen."
    rows = [
        (
            *(one.name, one.kind, _words(one.hidden)),
            "; ".join(f"{name}: {', '.join(map(_words, keys))}" for name, keys in one.alone.items() if keys)
            or "–",
            "; ".join(f"{_words(key)} ({status})" for key, status in one.together.items()) or "–",
        )
        for one in batches
    ]
    header = ("batch", "kind", "hidden", "named by each alone", "named by all together")
    return [
        tabulated("All observables together", figures(batches), note),
        Table("Batch by batch", header, rows),
    ]


def _words(key: Key | None) -> str:
    if key is None:
        return "–"
    return key[0] if key[1] == "all" else f"{key[0]} {key[1]}"
