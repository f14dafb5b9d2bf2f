"""Which runs identify and which validate: planned from the run table before any signal is read."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import pandas as pd

from metro.batch.runs import recorded
from metro.units import JSON

FEWEST_CONDITIONS = 3  # with fewer, holding one out leaves nothing to see a trend in
FEWEST_KEPT = 2
FEWEST_SPEEDS = 4  # of tests with a label, from which on whole speeds are held out
NUMBERS = ("feed_per_tooth_mm", "spindle_rpm", "axial_depth_mm", "radial_depth_mm")
ALONE = 8  # rank of the only condition of its operation: above any number of other settings at an end

# How unfit a condition is to be held out: whether at the edge of what was tried, how far so, the draw.
Rank = tuple[bool, int, str]


def plan(runs: pd.DataFrame, share: float, seed: int) -> JSON:
    """Give every recorded run one role.

    The roles of the table are kept. Where they are blank, whole conditions are held out, for each kind of
    measurement in turn, so that each keeps both roles where it can; conditions inside the range of feeds go
    before those at its ends, since a model is held to interpolate before it is asked to extrapolate. Tests
    that were judged stable or not, at :data:`FEWEST_SPEEDS` speeds or more, are held out by whole spindle
    speeds, all conditions of one together, unless the table itself holds a run out: the boundary at a speed
    is one number, which a test there at another depth gives away. Neither the order of the rows nor any
    signal matters.

    Parameters
    ----------
    runs : the run table as filled in, with ``run``, ``order``, ``condition`` and ``role``.
    share : of the conditions of each kind of measurement that is to be held out.
    seed : of the draw among conditions that are equally fit.

    Returns
    -------
    ``{"identify": [...], "validate": [...], "how": "...", "seed": n}``, runs in the order of cutting.
    """
    there = runs[recorded(runs)].sort_values(["order", "run"])
    roles = _declared(there)
    sentences = ["roles as the run table states them"] if roles else []
    if (there["role"] == "").any():
        kinds = _kinds(there)
        if not (there["role"] == "validate").any() and "stability" in kinds:
            sentences += _hold_out_speeds(there[kinds["stability"]], roles, share, seed)
        ranks = {kind: _ranks(there[has], seed) for kind, has in kinds.items()}
        fewest_first = sorted(ranks, key=lambda kind: (len(ranks[kind]), kind))
        sentences += [_hold_out(kind, ranks[kind], roles, share) for kind in fewest_first]
        sentences.append(f"drawn with seed {seed}")
    resolved = there["role"].mask(
        there["role"] == "", [roles.get(name, "identify") for name in there["condition"]]
    )
    return {
        "identify": list(there["run"][resolved == "identify"]),
        "validate": list(there["run"][resolved == "validate"]),
        "how": "; ".join(sentences) or "no run was recorded",
        "seed": seed,
    }


def _declared(runs: pd.DataFrame) -> dict[str, str]:
    """Return the role of each condition that the table gives one; identify where it gives both."""
    stated = runs[runs["role"] != ""]
    return {str(name): min(group) for name, group in stated.groupby("condition")["role"]}


def _kinds(runs: pd.DataFrame) -> dict[str, pd.Series]:
    """Return for each kind of measurement which runs have it."""
    force, arm = runs["dynamometer"] != "", (runs["robot_log"] != "") & (runs["idle_log"] != "")
    kinds = {
        "dynamometer": force,
        "dynamometer and robot log": force & arm,
        "profile": runs["profile"] != "",
        "scan": runs["scan"] != "",
        "stability": runs["stable"] != "",
    }
    return {kind: has for kind, has in kinds.items() if has.any()}


def _hold_out_speeds(tests: pd.DataFrame, roles: dict[str, str], share: float, seed: int) -> list[str]:
    """Fill in the roles of the tests' conditions by whole speeds, where these are enough; describe how.

    A speed at which the table gives a condition to identification stays there.
    """
    speed = tests.groupby("condition")["spindle_rpm"].min()
    speeds = sorted(speed.unique())
    if len(speeds) < FEWEST_SPEEDS:
        return []
    taken = set(speed[speed.index.isin(list(roles))])

    def rank(value: float) -> Rank:
        draw = hashlib.sha256(f"{seed}:{value:g}".encode()).hexdigest()
        return value in (speeds[0], speeds[-1]), 0, draw

    free = sorted((value for value in speeds if value not in taken), key=rank)
    wanted = min(max(1, round(share * len(speeds))), len(speeds) - FEWEST_KEPT)
    out = set(free[:wanted])
    for name, value in speed.items():
        roles.setdefault(str(name), "validate" if value in out else "identify")
    listed = ", ".join(f"{value:g}" for value in sorted(out)) or "none"
    return [f"stability: {len(out)} of {len(speeds)} whole spindle speeds held out (rev/min): {listed}"]


def _hold_out(kind: str, ranks: Mapping[str, Rank], roles: dict[str, str], share: float) -> str:
    """Fill in the roles of the conditions that have a kind of measurement; return what was done, in words."""
    free = sorted((name for name in ranks if name not in roles), key=lambda name: ranks[name])
    held = sum(roles.get(name) == "validate" for name in ranks)
    kept = len(ranks) - held - len(free)
    wanted = max(1, round(share * len(ranks))) if len(ranks) >= FEWEST_CONDITIONS else 0
    wanted = max(0, min(wanted - held, len(free) - max(0, FEWEST_KEPT - kept)))
    roles.update({name: "validate" if place < wanted else "identify" for place, name in enumerate(free)})
    out = sorted(name for name in ranks if roles[name] == "validate")
    if not out:
        few = f": at least {FEWEST_CONDITIONS} are needed" if len(ranks) < FEWEST_CONDITIONS else ""
        return f"{kind}: none of {len(ranks)} conditions held out{few}"
    outer = any(ranks[name][0] for name in free[:wanted])
    end = " (some at the edge of what was tried, as too few lie inside)" if outer else ""
    return f"{kind}: {len(out)} of {len(ranks)} conditions held out{end}: {', '.join(out)}"


def _ranks(runs: pd.DataFrame, seed: int) -> dict[str, Rank]:
    """Rank conditions by how far they are from being interpolated, among those of the same operation."""
    ranks: dict[str, Rank] = {}
    for _, group in runs.groupby("operation"):
        table = group.groupby("condition")[list(NUMBERS)].min()
        ends = ((table == table.min()) | (table == table.max())) & (table.min() < table.max())
        for name, row in ends.iterrows():
            # a number that depends on the seed and on the condition alone, not on the rows around it
            draw = hashlib.sha256(f"{seed}:{name}".encode()).hexdigest()
            alone = len(table) == 1
            ranks[str(name)] = (bool(row.iloc[0]) or alone, ALONE * alone + int(row.iloc[1:].sum()), draw)
    return ranks
