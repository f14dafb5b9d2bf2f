"""What the loop of a batch says over all its observables: its causes, and where errors come from upstream."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from metro.loop.causes.chain import split
from metro.loop.causes.witnesses import Closed
from metro.loop.search.trial import Gates
from metro.loop.verdict.batch_story import causes
from metro.observables.cut.upstream import mean_forces, with_forces
from metro.units import JSON


def across(
    closed: Mapping[str, Closed],
    verdicts: JSON,
    comparison: pd.DataFrame,
    observed: Mapping[str, pd.DataFrame],
    gates: Gates,
) -> JSON:
    """Return ``causes`` and ``chain`` of findings.json.

    Parameters
    ----------
    closed : by observable, its problem and outcome. verdicts : entries of verdict.json. comparison : rows of
        all observables. observed : the observed tables.
    """
    return {"causes": causes(closed, verdicts, gates), "chain": _chain(closed, comparison, observed)}


def _chain(
    closed: Mapping[str, Closed], comparison: pd.DataFrame, observed: Mapping[str, pd.DataFrame]
) -> JSON:
    """Split the error of each observable whose held-out runs have a measured and a predicted force."""
    forces = mean_forces(comparison)
    used = observed.get("tip_force", pd.DataFrame(columns=["run", "source"]))
    first = used.drop_duplicates("run")
    sources = dict(zip(first["run"].astype(str), first["source"].astype(str), strict=True))
    chain: JSON = {}
    for name, one in closed.items():
        held = [block for block in one.problem.role("validate") if block.run in forces]
        fed = {
            block.run: blocks
            for block in held
            if (blocks := with_forces(block, forces[block.run], sources)) is not None
        }
        if fed:
            chain[name] = split(one.problem, {"before": one.outcome.base, "after": one.outcome.final}, fed)
    return chain
