"""Is a campaign followed? Twenty batches of one shift, whose tool wears while the machine gets warm.

Not blind: the simulator's courses are known, and of the campaign memory it is asked whether the courses that
it states hold them. The next batch is predicted from all before it, batch after batch, and then measured.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from metro.batch.processed import read_batch
from metro.memory.history import Record
from metro.memory.remember import remember
from metro.units import JSON
from proof.layout import Layout
from proof.run import run
from proof.statistics import Demand, Figure, share
from proof.tables import Table, tabulated
from virtual_cell.recipes import shift

BATCHES = 20
FIRST = 8  # batches before the next one is predicted
WORN, FRESH = ("kte", "kre", "kae"), ("ktc", "krc", "kac")
WARM = "um_per_min"
INSIDE, CHANGES, STEADY = Demand(0.9), Demand(1.0), Demand(0.9)


@dataclass(frozen=True)
class Followed:
    """A parameter over the batches, as the memory has it and as it was.

    Attributes
    ----------
    name : of the quantity. course : as it is called. changes : whether it truly does.
    truth : its course at each batch that measures it. track : low, middle, high of what is stated there.
    ahead : of each batch that was predicted: low and high, what it then measured, and the true course.
    """

    name: str
    course: str
    changes: bool
    truth: tuple[float, ...]
    track: tuple[tuple[float, float, float], ...]
    ahead: tuple[tuple[float, float, float, float], ...]

    @property
    def change_detected(self) -> bool:
        """Whether it is said to change."""
        return self.course not in {"steady", "too few"}

    @property
    def inside(self) -> list[bool]:
        """Whether the stated course holds the true one, batch by batch."""
        return [low <= true <= high for true, (low, _, high) in zip(self.truth, self.track, strict=True)]

    @property
    def came(self) -> list[bool]:
        """Whether batches measured what had been predicted of them."""
        return [low <= measured <= high for low, high, measured, _ in self.ahead]

    @property
    def held(self) -> list[bool]:
        """Whether the predictions of batches held the true course."""
        return [low <= true <= high for low, high, _, true in self.ahead]


def followed(out: Layout, seed: int, jobs: int) -> list[Followed]:
    """Make the batches of a shift, run the pipeline on each, and follow what is known; goes on where stopped.

    Raises
    ------
    RuntimeError
        The pipeline failed on a batch; the reason is in its ``failed.txt``.
    """
    if not out.truth.is_file():
        out.truth.parent.mkdir(parents=True, exist_ok=True)
        truth = shift.make(out.raw, BATCHES, seed)
        out.truth.write_text(json.dumps(truth, indent=1) + "\n")
    failed = run(out, jobs, keep=False, pdf=False)
    if failed:
        raise RuntimeError(f"failed, see failed.txt in {out.reports}: {', '.join(failed)}")
    hidden = json.loads(out.truth.read_text())
    return compared([_record(out, name) for name in hidden["batches"]], hidden["batches"])


def _record(out: Layout, name: str) -> Record:
    batch = read_batch(out.processed / name)
    verdict, identified = (_read(out.reports / name / f"{kind}.json") for kind in ("verdict", "identified"))
    loop = _read(out.processed / name / "loop.json")
    return Record(name, batch.manifest, batch.started, verdict, loop, identified)


def _read(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text())
    return content


def compared(records: Sequence[Record], truth: JSON) -> list[Followed]:
    """Return a campaign's memory of the parameters whose truth is known, by batch, in their order.

    Parameters
    ----------
    truth : of each batch its ``coefficients`` and its ``growth``.
    """
    memories = [_series(remember(records[:known])) for known in range(FIRST, len(records) + 1)]
    return [_followed(one, memories, truth) for one in memories[-1].values()]


def _series(memory: JSON) -> dict[str, JSON]:
    """Return the series whose truth is known, by the name of the parameter."""
    named = {_name(one): one for one in memory["series"]}
    return {name: named[name] for name in (*WORN, *FRESH, WARM) if name in named}


def _name(series: JSON) -> str:
    return str(series["quantity"]).removeprefix("cutting coefficient ")


def _true(name: str, batch: JSON) -> float:
    return float(batch["growth"] if name == WARM else batch["coefficients"][name])


def _followed(series: JSON, memories: Sequence[dict[str, JSON]], truth: JSON) -> Followed:
    name = _name(series)
    measured = dict(zip(series["batches"], series["value"], strict=True))
    ahead = []
    for before, after in pairwise(memories):
        new = [] if name not in after else [b for b in after[name]["batches"] if b in measured]
        new = [batch for batch in new if batch not in before.get(name, {"batches": new})["batches"]]
        for batch in new:
            low, high = before[name]["next"]["ci95"]
            ahead.append((low, high, measured[batch], _true(name, truth[batch])))
    return Followed(
        name,
        course=series["course"],
        changes=name not in FRESH,
        truth=tuple(_true(name, truth[batch]) for batch in series["batches"]),
        track=tuple((low, middle, high) for low, middle, high in series["track"]),
        ahead=tuple(ahead),
    )


def figures(parameters: Sequence[Followed]) -> list[Figure]:
    """Return how often courses and predictions hold what they state, and what is demanded of it."""
    changing, steady = ([one for one in parameters if one.changes is asked] for asked in (True, False))
    return [
        share("what changes is said to change", [one.change_detected for one in changing], CHANGES),
        share("what does not is said to be steady", [not one.change_detected for one in steady], STEADY),
        share("courses: batches at which the interval holds the truth", _all("inside", parameters), INSIDE),
        share("of these, of what changes", _all("inside", changing)),
        share("predictions that hold what the next batch measured", _all("came", parameters), INSIDE),
        share("of these, of what changes", _all("came", changing)),
        share("predictions that hold the true course at the next batch", _all("held", parameters), INSIDE),
    ]


def _all(name: str, parameters: Sequence[Followed]) -> list[bool]:
    return [case for one in parameters for case in getattr(one, name)]


def tables(parameters: Sequence[Followed]) -> list[Table]:
    """Return the figures, and the parameters one by one."""
    note = (
        f"{BATCHES} batches of one shift; predictions from {FIRST} batches on. The batches of one course are "
        "not independent of one another: the intervals of the shares are too short."
    )
    rows = [
        (
            *(one.name, "changes" if one.changes else "steady", one.course, str(len(one.truth))),
            *(f"{one.truth[place]:.4g}" for place in (0, -1)),
            *(
                f"{middle:.4g} ({low:.4g} to {high:.4g})"
                for low, middle, high in (one.track[0], one.track[-1])
            ),
            *(f"{sum(cases)} of {len(cases)}" for cases in (one.inside, one.came)),
        )
        for one in parameters
    ]
    header = (
        *("parameter", "truly", "said", "batches", "first", "last", "told of the first", "of the last"),
        *("course holds", "next holds"),
    )
    return [tabulated("A campaign followed", figures(parameters), note), Table("Parameters", header, rows)]
