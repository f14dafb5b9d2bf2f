"""Blind force batches of the simulator, and what the loop says of them: for the tests of the effects."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from worded import in_words

from metro.batch.processed import Processed, read_batch
from metro.effects.library import library
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.verdict.verdict import judge
from metro.observables.force import observable as force
from metro.stages.ingest import ingest
from virtual_cell.recipes.force import make

GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)


@cache
def clean(seed):
    """Close the loop on a batch that hides nothing; once for the tests of the group "blind-clean"."""
    with TemporaryDirectory() as folder:
        return closed(Path(folder), {}, seed)


def closed(folder, effects, seed):
    """Make a batch that hides ``effects``, and let the loop judge its force with the whole library."""
    make(folder / "blind-test", effects, seed)
    ingest(folder / "blind-test", folder, folder / "out", {}, "test")
    batch = read_batch(folder / "out")
    observed = force.observe(batch, Processed(folder / "out"), {})
    task = force.problem(batch, observed, {})
    outcome = search(task, library("force"), GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return outcome, in_words(judge(task, outcome, rows, GATES)), batch.manifest["tool"]["teeth"]
