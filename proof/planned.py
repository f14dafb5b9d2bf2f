"""Do planned runs decide? Batches with too few conditions are asked about, and what is planned is cut.

Each batch hides one effect of the library, so small that it can just be detected, and consists of three
narrow side cuts, along which most effects are confounded. Where the verdict is ``undetermined``, ``metro
next``, given how deep the machine may cut, plans runs from what the stages wrote; the simulator cuts exactly
these, by the same tool in the same metal, and the pipeline runs on all runs again.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from metro.stages.next_runs import next_runs
from metro.units import JSON
from proof.layout import Layout
from proof.run import run
from proof.statistics import Demand, Figure, median, share
from proof.tables import Table, tabulated
from virtual_cell.hidden import drawn_angle, drawn_size
from virtual_cell.recipes.force import FEW, cut_more, make

OBSERVABLE = "force"
MOST = 12  # runs that may be planned
LIMITS = ("axial_depth_mm=0.25:4",)  # declared by the owner of the machine; the batches are 0.5 to 1 mm deep
DEMAND = Demand(0.8)


@dataclass(frozen=True)
class Asked:
    """A batch that was undetermined, what was planned, and the verdict with the planned runs.

    ``chance``: the stated probability of deciding, None where no run was planned.
    """

    name: str
    hidden: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    words: str
    chance: float | None
    runs: int
    status: str
    named: tuple[str, ...]

    @property
    def decided(self) -> bool:
        """Whether the cause is no longer undetermined."""
        return self.runs > 0 and self.status != "undetermined"

    @property
    def right(self) -> bool:
        """Whether what is hidden is named, and nothing else."""
        return self.decided and set(self.named) == set(self.hidden)


def asked_and_cut(out: Layout, batches: int, seed: int, jobs: int) -> tuple[list[Asked], int]:
    """Make batches, ask about those that are undetermined, cut what is planned and judge again.

    Goes on where it was stopped. Returns the batches that were asked about, and the number of all.
    """
    out.raw.mkdir(parents=True, exist_ok=True)
    for place in range(batches):
        folder, each = out.raw / f"few-{place:03d}", 100_000 * seed + place
        if not _truth(out, folder.name).is_file():
            truth = make(folder, _small(place, each), each, FEW)
            _truth(out, folder.name).parent.mkdir(exist_ok=True)
            _truth(out, folder.name).write_text(json.dumps(truth, indent=1) + "\n")
    _run(out, jobs)
    later, names = Layout(out.root / "later"), [name for name in out.batches if _open(out, name)]
    plans = {name: _continued(out, later, name) for name in names}
    _run(later, jobs)
    return [_asked(out, later, name, plans[name]) for name in names], len(out.batches)


def _small(place: int, seed: int) -> dict[str, JSON]:
    """Draw the effect that a batch hides: its size log-uniform about what can just be detected."""
    rng = np.random.default_rng([seed, 31])
    radius, exponent, *stiffness = (
        drawn_size(rng, low, high) for low, high in ((0.7, 3.0), (0.03, 0.12), (6.0, 30.0), (6.0, 30.0))
    )
    runout: JSON = {"radius_um": radius, "angle_deg": drawn_angle(rng)}
    deflection: JSON = dict(zip(("kx_n_um", "ky_n_um"), stiffness, strict=True))
    # Runout is hidden every other time: small, it is the effect that looks most like others.
    choices = ("tool_runout", runout), ("chip_size_effect", {"exponent": exponent})
    more = ("tool_runout", runout), ("tool_deflection", deflection)
    name, parameters = (*choices, *more)[place % 4]
    return {name: parameters}


def _run(out: Layout, jobs: int) -> None:
    failed = run(out, jobs, keep=False, pdf=False) if out.batches else []
    if failed:
        raise RuntimeError(f"failed, see failed.txt in {out.reports}: {', '.join(failed)}")


def _truth(out: Layout, name: str) -> Path:
    return out.truth.parent / f"{name}.json"


def _verdict(out: Layout, name: str) -> JSON:
    entry: JSON = json.loads((out.reports / name / "verdict.json").read_text())["observables"][OBSERVABLE]
    return entry


def _open(out: Layout, name: str) -> bool:
    return bool(_verdict(out, name)["status"] == "undetermined")


def _continued(out: Layout, later: Layout, name: str) -> JSON:
    """Plan runs, and cut them after those of a batch, in a copy of it; return the plan."""
    folder, plan, table = later.raw / name, later.root / f"{name}.json", later.root / f"{name}.csv"
    if plan.is_file():
        content: JSON = json.loads(plan.read_text())
        return content
    later.raw.mkdir(parents=True, exist_ok=True)
    table.unlink(missing_ok=True)
    said = StringIO()
    with redirect_stdout(said):
        next_runs(
            name, OBSERVABLE, most=MOST, limits=LIMITS, out=table, seed=0,
            processed=out.processed, reports=out.reports, as_json=True,
        )  # fmt: skip
    content = json.loads(said.getvalue())
    if table.is_file():
        shutil.copytree(out.raw / name, folder, dirs_exist_ok=True)
        truth = json.loads(_truth(out, name).read_text())
        rows = pd.read_csv(table).astype(object)
        records = rows.where(rows.notna(), None).to_dict("records")
        given = [{str(key): value for key, value in record.items()} for record in records]
        cut_more(folder, given, truth["effects"], truth["seed"], truth["style"])
    plan.write_text(json.dumps(content, indent=1) + "\n")
    return content


def _asked(out: Layout, later: Layout, name: str, plan: JSON) -> Asked:
    runs, question = len(plan["runs"]), plan["questions"][0]
    after = _verdict(later if runs else out, name)
    return Asked(
        name,
        hidden=tuple(json.loads(_truth(out, name).read_text())["effects"]),
        pairs=tuple((first, second) for first, second in _verdict(out, name)["indistinguishable"]),
        words=question["words"],
        chance=question["chance"] if runs else None,
        runs=runs,
        status=after["status"],
        named=tuple(effect["effect"] for effect in after["effects"]),
    )


def figures(asked: Sequence[Asked]) -> list[Figure]:
    """Return how often the planned runs decide, how often rightly, and what was stated beforehand."""
    stated = [one.chance for one in asked if one.chance is not None]
    return [
        share("undetermined batches that the planned runs decide", [one.decided for one in asked], DEMAND),
        share(
            "of these, what is hidden is named and nothing else", [one.right for one in asked if one.decided]
        ),
        median("probability of deciding that was stated", stated),
        median("planned runs", [float(one.runs) for one in asked if one.runs]),
    ]


def tables(asked: Sequence[Asked], batches: int) -> list[Table]:
    """Return the figures, and the batches that were asked about, one by one."""
    note = f"{len(asked)} of {batches} batches were undetermined; at most {MOST} runs each may be planned."
    rows = [
        (
            one.name,
            ", ".join(one.hidden),
            "; ".join(" or ".join(pair) for pair in one.pairs),
            str(one.runs),
            "–" if one.chance is None else f"{one.chance:.2f}",
            one.status,
            ", ".join(one.named) or "–",
        )
        for one in asked
    ]
    header = ("batch", "hidden", "undetermined", "runs", "stated", "then", "named")
    return [tabulated("Planned runs", figures(asked), note), Table("Batch by batch", header, rows)]
