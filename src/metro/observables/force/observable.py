"""Cutting force: dynamometer records as order averages, and the mechanistic model that predicts them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.cutting.chip import path_difference
from metro.cutting.cutter import Cutter
from metro.cutting.helical import bottom_thrust
from metro.cutting.law import EdgeLaw
from metro.observables.arm.wall import wall
from metro.observables.cut import conditions as cutting_force
from metro.observables.force import NAME, TABLES
from metro.observables.force.blocks import block_of
from metro.observables.force.bottom_edges import advice, told_apart
from metro.observables.force.coefficients import correlation, mean_coefficients, waveform
from metro.observables.force.dynamometer import Dynamometer
from metro.observables.force.held_out_give import with_predicted_give
from metro.observables.force.mean_bias import mean_bias
from metro.observables.force.model import ForceModel
from metro.observables.force.orders import observe, recorded
from metro.observables.force.proposals import feasible
from metro.observables.force.static_meaning import static_deflection
from metro.observables.force.yielding_table import yielding_table
from metro.observables.observable import Observable
from metro.observables.problem import BaseFit, Block, Problem, Refusal
from metro.observables.quantity import quantity
from metro.units import JSON, MM, N_MM2, UM, Array

__all__ = ["NAME", "observe", "problem", "report"]

SCATTER = 0.01
UNIDENTIFIED_KFAC = (
    140.0 * N_MM2
)  # rms of what it may be: anything up to the 243 N/mm² that [T] table 4 found
CHATTERED = "no"  # in the column ``stable``
HEIGHTS = 5.0 * UM  # mean by which a bottom edge stands back behind the lowest one, of a tool that is good
LEAST_FEED_RATIO = 1.1  # between axial feeds at which the thrust of an unknown K_Fac differs


def problem(batch: Batch, observed: Mapping[str, pd.DataFrame], _identified: JSON) -> Problem | Refusal:
    """Blocks of evidence from the order averages, and the base model without any effect, declared or not."""
    tool = cutting_force.cutter(batch)
    if isinstance(tool, Refusal) or "orders" not in observed:
        return tool if isinstance(tool, Refusal) else Refusal("no order averages")
    by_run = dict(tuple(observed["orders"].groupby("run", sort=False)))
    spindle = with_predicted_give(batch, observed["spindle"], tool).set_index("run")
    runs = [run for run in recorded(batch) if run in by_run]
    chattered = [run for run in runs if str(batch.runs.loc[run, "stable"]) == CHATTERED]
    if len(chattered) == len(runs):
        return Refusal("every run with a record chattered (column stable); the model is of a steady cut")
    blocks = tuple(block_of(batch, run, by_run[run], tool, spindle) for run in runs if run not in chattered)
    helical = any(block.setting.helix is not None for block in blocks)
    bottom = _bottom_edges(blocks)
    if bottom == ("kfae",):
        blocks = _at_other_feeds(blocks, tool)
    model = _base(batch, tool, bottom)
    notes = [
        "The chip thickness is that of the true tooth paths, the force law linear in it; "
        "tool, machine and dynamometer are rigid in the base model.",
        cutting_force.end_note(batch, tool),
        _path_note(tool, blocks),
        *_give_note(batch, observed["spindle"]),
        *_thrust_note(blocks),
        f"Forces are compared per revolution up to spindle order {blocks[0].setting.highest}, "
        "in the work frame"
        + (" (helical runs: in the frame that turns with the orbit)." if helical else "."),
        *(f"Left out: {reason}." for reason in observed["force_refused"]["reason"]),
        *_chatter_note(chattered),
    ]
    scatter = np.full(len(model.parameters), SCATTER)
    next_runs = feasible(blocks, tool, batch.manifest.get("limits"))
    return Problem(NAME, "N", 1.0, model, blocks, scatter, notes=tuple(notes), feasible=next_runs)


def _base(batch: Batch, tool: Cutter, bottom: tuple[str, ...]) -> ForceModel:
    """Return the model without any effect, declared or not."""
    return ForceModel(
        cutter=replace(tool, runout_radius=0.0, runout_angle=0.0),  # what is declared of it is an effect's
        law=EdgeLaw(),
        bottom_edges=bottom,
        sensor=Dynamometer(axes=cutting_force.channels(batch)),
        end_declared=cutting_force.end_declared(batch),
    )


def _chatter_note(runs: list[str]) -> tuple[str, ...]:
    """Say which runs are left out because they chattered."""
    note = f"Left out: {', '.join(runs)}, which chattered (column stable): the model is of a steady cut."
    return (note,) if runs else ()


def _path_note(tool: Cutter, blocks: tuple[Block, ...]) -> str:
    """Say how far the true tooth paths are from feed × sine of the immersion, at the largest feed."""
    widest = max((block.setting.cut for block in blocks), key=lambda cut: cut.feed_per_tooth)
    difference = path_difference(tool, widest)
    share = difference.largest / widest.feed_per_tooth
    return (
        f"At {widest.feed_per_tooth / MM:.3g} mm per tooth the true chip differs from feed × sine by up to "
        f"{difference.largest / UM:.2g} µm ({100 * share:.2g} % of the feed), "
        f"{difference.rms / UM:.2g} µm rms."
    )


def _give_note(batch: Batch, spindle: pd.DataFrame) -> tuple[str, ...]:
    """Say by how much an arm gives way in side cuts, or that nobody knows."""
    run, give = max(zip(spindle["run"], spindle["give_mm"], strict=True), key=lambda one: abs(one[1]))
    if give:
        return (
            "The radial depth of side cuts is the nominal one less what the arm gives way to the mean force "
            f"by its load tests: at most {give:.2g} mm, in run {run}. That force is the measured one in "
            "runs of the identification; in held-out runs it is predicted together with the give.",
        )
    if "arm" in batch.cell and any(wall(batch, name).normal.any() for name in spindle["run"]):
        return (
            "The deflection of the arm in side cuts is not known, because it has no load tests in this pose. "
            "The radial depth is taken as programmed; the deflection then appears in the forces of up and "
            "down milling with opposite signs.",
        )
    return ()


def _bottom_edges(blocks: tuple[Block, ...]) -> tuple[str, ...]:
    """Coefficients of the bottom edges that the helical runs identify: feeds too alike give the sum alone."""
    feeds = _axial_feeds(blocks)
    if not feeds:
        return ()
    return ("kfac", "kfae") if told_apart(feeds) else ("kfae",)


def _axial_feeds(blocks: tuple[Block, ...]) -> list[float]:
    """Axial feed per tooth, m, of each helical identification run."""
    helices = [block.setting.helix for block in blocks if block.role == "identify"]
    return [helix.axial_feed for helix in helices if helix]


def _at_other_feeds(blocks: tuple[Block, ...], tool: Cutter) -> tuple[Block, ...]:
    """Allow helical runs at another axial feed than the one that was identified to have another thrust."""
    feeds = _axial_feeds(blocks)
    identified = [block for block in blocks if block.role == "identify" and block.setting.helix]
    thrust = float(np.mean([abs(_mean_thrust(block)) for block in identified]))

    def with_unknown(block: Block) -> Block:
        feed = block.setting.helix.axial_feed
        edges = thrust * _other_edges(tool.teeth, feed, min(max(feed, min(feeds)), max(feeds)))
        unknown = _unidentified_thrust(block, tool, float(np.mean(feeds)), edges)
        return replace(block, unidentified=unknown)

    return tuple(with_unknown(block) if block.setting.helix else block for block in blocks)


def _mean_thrust(block: Block) -> float:
    """Return the measured mean force along z of a block, N."""
    axial = block.zeros[:, 2]
    return float(block.measured @ axial / (axial @ axial))


def _unidentified_thrust(block: Block, tool: Cutter, identified_feed: float, edges: float) -> Array | None:
    """Direction (n, 1) of what is unknown of the thrust at an axial feed other than the identified one.

    That is K_Fac, and the thrust of ``edges``, N, that begin to cut, or stop, between the two feeds.
    """
    helix = block.setting.helix
    if max(helix.axial_feed, identified_feed) <= LEAST_FEED_RATIO * min(helix.axial_feed, identified_feed):
        return None
    per_unit = bottom_thrust(tool, helix)[0] * (1.0 - identified_feed / helix.axial_feed)
    return np.asarray(math.hypot(UNIDENTIFIED_KFAC * per_unit, edges) * block.zeros[:, 2:])


def _other_edges(teeth: int, feed: float, other: float) -> float:
    """Return the rms share of bottom edges that cut at one axial feed per tooth, m, and not at another one.

    An edge cuts where the tool sinks by more than the edge stands back behind the lowest one, whose height is
    taken as exponential, of mean ``HEIGHTS``: all but the lowest are such edges, each for itself. Those that
    begin to cut between two identified feeds would show there.
    """
    between = abs(math.exp(-feed / HEIGHTS) - math.exp(-other / HEIGHTS))
    others = teeth - 1
    return math.sqrt(others * between * (1.0 - between) + (others * between) ** 2) / teeth


def _thrust_note(blocks: tuple[Block, ...]) -> tuple[str, ...]:
    """Say of which runs the thrust of the bottom edges is not known, and how large that is."""
    others = [block for block in blocks if block.role != "identify"]
    unknown = {one.run: one.unidentified for one in others if one.unidentified is not None}
    if not unknown:
        return ()
    largest = max(float(np.abs(each).max()) for each in unknown.values())
    return (
        f"The helical runs {', '.join(unknown)} have another axial feed than those of the identification. "
        "How much thrust the bottom edges cause there is not known: neither K_Fac nor, as edges differ in "
        f"height by some micrometres, how many of them cut. Their mean force along z is left open by up to "
        f"{largest:.2g} N (one standard deviation).",
    )


def report(
    _batch: Batch,
    observed: Mapping[str, pd.DataFrame],
    _identified: JSON,
    task: Problem | Refusal,
    fit: BaseFit | None,
) -> JSON:
    """Return coefficients by means and by waveform, and each run's spindle speed, for identified.json."""
    if isinstance(task, Refusal):
        return {}
    model = cast("ForceModel", task.base)
    spindle = observed["spindle"]
    runs = zip(spindle["run"], spindle["spindle_rpm"], spindle["spindle_rpm_sd"], strict=True)
    block: JSON = {
        "spindle_rpm": {run: quantity(speed, sd, "rpm") for run, speed, sd in runs},
        "edge_length": "axial",
    }
    turned = all(block.setting.helix is not None for block in task.role("identify"))
    results: dict[str, JSON | Refusal] = {
        "mean": mean_coefficients(model, task.role("identify"), spindle),
        "mean_all_runs": mean_coefficients(model, task.blocks, spindle),
        "waveform": waveform(model, fit, turned=turned),
    }
    lacking = {name: value.reason for name, value in results.items() if isinstance(value, Refusal)}
    if turned and fit:
        lacking["ktc"] = lacking["krc"] = lacking["kte"] = lacking["kre"] = (
            "all runs are helical, and the place on the orbit where their records begin is not known: the "
            "force in the plane is determined except for a rotation; cut one slot"
        )
    if model.bottom_edges == ("kfae",):
        lacking["kfac"] = (
            "kfae holds the whole thrust of the bottom edges. K_Fac takes "
            f"{advice(_axial_feeds(task.blocks))}"
        )
    block |= {name: value for name, value in results.items() if not isinstance(value, Refusal)}
    block |= correlation(model, fit)
    return {"force": {**block, "not_identified": lacking} if lacking else block}


def after_loop(
    batch: Batch, observed: Mapping[str, pd.DataFrame], identified: JSON, problem: Problem, fit: BaseFit
) -> JSON:
    """Return what the effects found make of the coefficients that the mean forces give."""
    tool, reported = cutting_force.cutter(batch), identified.get("force") or {}
    if isinstance(tool, Refusal):
        return {}
    base = _base(batch, tool, cast("ForceModel", problem.base).bottom_edges)
    block = mean_bias(base, problem, observed["spindle"], reported, fit)
    return {"force": block} if block else {}


def yielding(batch: Batch, read: Tables, identified: JSON) -> tuple[dict[str, pd.DataFrame], JSON]:
    """Return what a tabulated machine's stiffness makes of the identified cutting force."""
    table = yielding_table(batch, read, identified)
    if isinstance(table, Refusal):
        return {}, {}
    static = static_deflection(batch, read, identified)
    return {"yielding": table}, {"force": {"static_deflection": static}} if static else {}


OBSERVABLE = Observable(
    NAME, TABLES, observe, problem, report, beside=yielding, gives_coefficients=True, after_loop=after_loop
)
