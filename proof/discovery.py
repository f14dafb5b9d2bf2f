"""The proof of discovery: what ``metro propose`` says of a suite whose batches hide causes or nothing.

An oracle is fitted beside it: the term of the grammar that a cause outside the library is an instance of,
from the same fit. Causes without such a term have right variables at most.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from metro.discovery.record import verified
from metro.discovery.search import Search, admitted, tried_term
from metro.observables.problem import Problem
from metro.stages.propose import proposed
from metro.units import JSON
from proof import seal
from proof.layout import Layout


@dataclass(frozen=True)
class Right:
    """What is right of a cause: a variable of the term, and a pattern of names of its form ("": none)."""

    variables: frozenset[str]
    form: str


# The axes of a force are named by their number in the truth; "." stands for any.
RIGHT: Mapping[str, Right] = {
    "loose_bolt": Right(
        frozenset({"force along x", "force along y", "force along z"}), r"bent_\w+_reading_."
    ),
    "creeping_shim": Right(frozenset({"travel"}), r"depth_by_travel_saturating"),
    "coolant_jet": Right(frozenset({"travel", "time"}), r"push_._by_travel_step"),
    "power_sag": Right(frozenset({"time"}), ""),
    "worn_way": Right(frozenset({"path", "time"}), ""),
    "moving_resonance": Right(frozenset({"frequency", "travel"}), ""),
    "chip_recutting": Right(frozenset({"time"}), ""),
    "coating_loss": Right(frozenset({"tooth", "travel"}), r"tooth_\d_by_travel_step"),
    "cable_microphonics": Right(frozenset({"time"}), ""),
    "race_ovality": Right(frozenset({"spindle angle"}), r"shear_wave_order_\d"),
    "corner_blending": Right(frozenset({"path", "time"}), ""),
    "stick_slip": Right(frozenset({"time"}), ""),
    "built_up_edge": Right(frozenset({"time"}), ""),
    "hard_skin": Right(frozenset({"height"}), r"top_layer"),
    "slanted_blank": Right(frozenset({"path", "time"}), r"depth_by_path"),
    "heat_softening": Right(frozenset({"speed"}), r"shear_force_by_speed"),
    "chipped_tooth": Right(frozenset({"tooth"}), r"tooth_\d"),
    "hard_spot": Right(frozenset({"path", "time"}), r"(shear|tangential)_force_by_time_step"),
    "speed_dependence": Right(frozenset({"speed"}), r"shear_force_by_speed"),
    "lagging_channel": Right(frozenset({"frequency"}), r"lag_of_first_order"),
    "second_orbit_stiffness": Right(frozenset({"orbit"}), ""),
    "slow_growth": Right(frozenset({"travel"}), r"depth_by_travel(_saturating)?"),
    "tilted_surface": Right(frozenset({"path", "time"}), r"depth_by_path"),
    "sagging_gain": Right(frozenset({"travel"}), ""),
}


@dataclass(frozen=True)
class Discovery:
    """What was said of a batch, and what is true of it.

    ``kind``: of the suite. ``hidden``: names of what it hides. ``verdict``: status. ``proposal``: name of the
    term, empty: none. ``variables`` and ``form``: whether they are right (None: no proposal, or no such form
    in the grammar). ``before``, ``after``: rms error on the verification runs without and with the proposal;
    ``oracle``: with the right term. ``seconds`` that the search took.
    """

    batch: str
    kind: str
    hidden: tuple[str, ...]
    verdict: str
    proposal: str
    variables: bool | None
    form: bool | None
    before: float | None
    after: float | None
    oracle: float | None
    seconds: float


def discoveries(out: Layout) -> list[Discovery]:
    """Search every batch of a suite that the pipeline has run on, and compare with the truth."""
    truth = seal.unseal(out.truth, out.seal)["batches"]
    return [
        _discovery(out, name, entry)
        for name, entry in truth.items()
        if (out.reports / name / "run.json").is_file()
    ]


def _discovery(out: Layout, name: str, truth: JSON) -> Discovery:
    start = time.process_time()
    said, search, problem = proposed(out.processed / name, out.reports / name)
    seconds = time.process_time() - start
    chosen = said.get("proposal")
    right = next((RIGHT[cause] for cause in truth["effects"] if cause in RIGHT), None)
    term: Any = next((one for one in said.get("terms", ()) if chosen and one["name"] == chosen["name"]), None)
    known = right is not None and term is not None
    verification = (chosen or {}).get("verification") or {}
    oracle = _oracle(search, problem, right) if search and problem and right and right.form else None
    return Discovery(
        name,
        str(truth["kind"]),
        tuple(truth["effects"]),
        said["verdict"],
        term["name"] if term else "",
        bool(right.variables & set(term["variables"])) if known and right else None,
        bool(re.fullmatch(right.form, term["name"])) if known and right and right.form else None,
        verification.get("before", oracle[0] if oracle else None),
        verification.get("after"),
        oracle[1] if oracle else None,
        seconds,
    )


def _oracle(search: Search, problem: Problem, right: Right) -> tuple[float, float] | None:
    """Rms error on the verification runs without and with the best of the terms of the right form."""
    forms = [one for one in admitted(problem, search.current) if re.fullmatch(right.form, one.name)]
    fits = [tried_term(search, one) for one in forms]
    if not fits:
        return None
    figures = verified(search.current, max(fits, key=lambda fitted: fitted.total), problem)
    return (figures["before"], figures["after"]) if figures else None


def printed(found: list[Discovery]) -> str:
    """Return a table of all batches, and the figures."""
    lines = ["| batch | hidden | verdict | proposed | variables | form | before | after | oracle | s |"]
    lines.append("|" + " --- |" * 10)
    for one in found:
        cells = (
            one.batch,
            ", ".join(one.hidden) or "nothing",
            one.verdict.replace("_", " "),
            one.proposal.replace("_", " ") or "–",
            _yes(one.variables),
            _yes(one.form),
            *(f"{value:.3g}" if value is not None else "–" for value in (one.before, one.after, one.oracle)),
            f"{one.seconds:.0f}",
        )
        lines.append("| " + " | ".join(cells) + " |")
    outside = [one for one in found if one.kind == "outside"]
    made = [one for one in outside if one.proposal]
    inside = [one for one in found if one.kind != "outside"]
    formed = [one.form for one in made if one.form is not None]
    lines += [
        "",
        f"Proposals where nothing outside the library is hidden: "
        f"{sum(bool(one.proposal) for one in inside)} of {len(inside)}.",
        f"Outside causes for which something is proposed: {len(made)} of {len(outside)}.",
        f"Right variables: {sum(bool(one.variables) for one in made)} of {len(made)} proposals.",
        f"Right form: {sum(map(bool, formed))} of {len(formed)} proposals whose form the grammar has.",
    ]
    shares = [(one.batch, _share(one)) for one in outside]
    told = [f"{batch} {100.0 * share:.0f} %" for batch, share in shares if share is not None]
    lines.append(f"Share of the oracle's gain on verification runs: {', '.join(told) or 'no case'}.")
    return "\n".join(lines)


def _share(one: Discovery) -> float | None:
    """Share of the oracle's gain that is reached: 0 without a proposal; None where the oracle gains none."""
    if one.oracle is None or one.before is None or one.oracle >= one.before:
        return None
    return 0.0 if one.after is None else (one.before - one.after) / (one.before - one.oracle)


def _yes(answer: bool | None) -> str:
    return "–" if answer is None else "right" if answer else "wrong"


def written(found: list[Discovery], out: Layout) -> None:
    """Write what was found beside the suite."""
    text = json.dumps([vars(one) for one in found], indent=1)
    (out.root / "discoveries.json").write_text(text)
    (out.root / "discovery.md").write_text(printed(found) + "\n")
