"""All contradictions between the data of a batch and what it declares."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.problem import Problem
from metro.observables.stability.modal_test import receptances
from metro.observables.task import Task
from metro.slips.force import force_slips, speed_slips
from metro.slips.joints import joint_slips
from metro.slips.labels import label_slips
from metro.slips.pairs import pair_slips
from metro.slips.phases import phase_slips
from metro.slips.redundancy import stiffness_slips
from metro.slips.scans import scan_slips
from metro.slips.slip import Slip
from metro.units import JSON

JUDGED = ("force", "joint_force", "lobes")  # observables whose problems and tables are looked at
LABEL = {"yes": 0.0, "no": 1.0}  # the column ``stable``, as unstable


def find(
    batch: Batch,
    read: Tables,
    observed: Mapping[str, pd.DataFrame],
    tasks: Mapping[str, Task],
    identified: JSON,
) -> tuple[Slip, ...]:
    """Return what contradicts, the most fundamental first: what a wrong speed or force spoils is not judged.

    Parameters
    ----------
    read : the canonical tables. observed, tasks : observed tables and problems, by name.
    identified : content of identified.json.
    """
    slips = speed_slips(batch, read) or _of(tasks, "force", lambda task: force_slips(batch, task))
    if not any(slip.observables for slip in slips):
        slips = (*slips, *_of(tasks, "joint_force", joint_slips))
    return (*slips, *_of_the_machine(batch, read, observed, identified))


def _of_the_machine(
    batch: Batch, read: Tables, observed: Mapping[str, pd.DataFrame], identified: JSON
) -> Iterator[Slip]:
    modes = identified.get("modes") or []
    yield from stiffness_slips(read("stations"), modes)
    yield from phase_slips(observed["frf_used"], modes) if "frf_used" in observed else ()
    if not read("hit").empty and not read("frf").empty:
        yield from pair_slips(receptances(read, batch.instrument("hammer"), []))
    yield from label_slips(_labelled(batch, observed), _heard(observed))
    yield from scan_slips(batch, read)


def _of(
    tasks: Mapping[str, Task], name: str, judge: Callable[[Problem], tuple[Slip, ...]]
) -> tuple[Slip, ...]:
    """Judge the problem of an observable, where the batch has one."""
    task = tasks.get(name)
    return judge(task) if isinstance(task, Problem) else ()


def _labelled(batch: Batch, observed: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return depth and boundary of the labelled cuts."""
    tests = observed.get("lobe_runs", pd.DataFrame())
    if tests.empty:
        return pd.DataFrame(columns=["depth_mm", "boundary_mm", "labelled"], dtype=float)
    return tests.assign(labelled=tests["run"].map(batch.runs["stable"]).map(LABEL)).dropna(subset="labelled")


def _heard(observed: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    return observed.get("chatter_runs", pd.DataFrame({"probability": [], "labelled": []}, dtype=float))
