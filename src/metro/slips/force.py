"""The force records against what the batch declares of sensor, tool, cut and speed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.cutting.cutter import Cutter
from metro.observables.cut.conditions import or_zero
from metro.observables.cut.long_record import LongRecord
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem
from metro.slips import channels, chip_geometry, orientation, run_table
from metro.slips.hypothesis import Hypothesis
from metro.slips.physical import against_helix, coefficients_text, impossible, mean_chip, out_of_scale
from metro.slips.slip import Slip
from metro.slips.speed import period, repeats_per_revolution, turns_as_declared
from metro.slips.waveform import Design, Record, WaveFit, design, fit, record_of
from metro.units import JSON, MM

OBSERVABLES = ("force", "joint_force", "deformation", "waviness", "flatness", "lobes")
# Misfit of another bookkeeping with possible coefficients over that of the declared one. Of 40 simulated
# batches with hidden effects none is below 0.96 (docs/slips.md); 0.8 leaves room for effects never seen.
BETTER = 0.8
ALIKE = 1.1  # misfit over the least: bookkeepings that the waveform does not distinguish
MOST_NAMED = 3
ENDS = (0.4, 1.0)  # corner radii over the radius: a bull nose and a ball
LEAST_RATIO = 1.2  # between depths of cut that show a corner
END, AXES_AND_END = "end", "axes and end"  # kinds: the end alone is another one, or the axes as well


@dataclass(frozen=True, eq=False)
class Tried:
    """A hypothesis and its fit."""

    hypothesis: Hypothesis
    fitted: WaveFit


def force_slips(batch: Batch, problem: Problem) -> tuple[Slip, ...]:
    """Fit the straight cuts under the declared bookkeeping and under every slip of the list.

    A slip is stated where the declared coefficients are impossible, or where another bookkeeping, with
    possible ones, explains the waveforms decisively better; one that spoils nothing, where all that speaks
    against the declaration is which way the axial force points. Helical cuts alone give none: where on the
    orbit they begin is not known.
    """
    records = [record_of(block) for block in problem.blocks if block.setting.helix is None]
    base = cast("ForceModel", problem.base)
    ends = () if base.end_declared else _ends(base.cutter, records)
    return contradictions(records, base.cutter, batch.instrument("dynamometer"), ends) if records else ()


def _ends(cutter: Cutter, records: Sequence[Record]) -> tuple[Cutter, ...]:
    """Return what the end may be that nobody declared; nothing where the runs are of one depth.

    At one depth a corner mixes the radial with the axial force as wrong coefficients do.
    """
    depths = [record.setting.cut.axial_depth for record in records]
    if not records or max(depths) < LEAST_RATIO * min(depths):
        return ()
    return tuple(replace(cutter, corner=share * cutter.radius) for share in ENDS)


def contradictions(
    records: list[Record], cutter: Cutter, sensor: JSON, ends: Sequence[Cutter] = ()
) -> tuple[Slip, ...]:
    """Return the slip of straight cuts, if there is one.

    An end of the tool that explains the records with the axes as declared is no slip: the loop looks for it.

    Parameters
    ----------
    sensor : its entry of the manifest. ends : the cutter with the ends that it may have instead.
    """
    designs = [design(cutter, record.setting) for record in records]
    declared, chip, helix = fit(records, designs), mean_chip(records), _deciding(cutter)
    faults = impossible(declared, chip, helix)
    tried = [Tried(one, one.fitted()) for one in _hypotheses(records, designs, cutter, sensor, declared)]
    possible = [
        one
        for one in tried
        if not (impossible(one.fitted, chip, helix) or against_helix(one.fitted, chip, helix))
    ]
    others = [Tried(one, one.fitted()) for one in _with_ends(records, ends, sensor)]
    possible += [one for one in others if not impossible(one.fitted, chip, 0.0)]
    limit = declared.misfit * (ALIKE if faults else BETTER)
    better = sorted((one for one in possible if one.fitted.misfit < limit), key=lambda one: one.fitted.misfit)
    if not faults and not better:
        return _upside_down(declared, possible, chip, helix)
    factor = out_of_scale(declared, chip, helix)
    if factor is not None and all(one.fitted.misfit > BETTER * declared.misfit for one in tried):
        return (_of_another_size(declared, faults, factor),)
    least = better[0].fitted.misfit if better else math.nan
    named = [one for one in better if one.fitted.misfit <= ALIKE * least]
    if any(one.hypothesis.kind == END for one in named):
        return ()
    return (_slip(declared, faults, named[:MOST_NAMED], chip),)


def _upside_down(declared: WaveFit, possible: list[Tried], chip: float, helix: float) -> tuple[Slip, ...]:
    """Return what is to be checked where an axial force is not as the helix; alone it spoils no result."""
    found = against_helix(declared, chip, helix)
    alike = [one for one in possible if one.fitted.misfit < ALIKE * declared.misfit]
    if not found or not alike:
        return ()
    best = min(alike, key=lambda one: one.fitted.misfit).hypothesis
    remedy = (
        f"Either fz has the other sign, then write {best.remedy}; or the tool is pulled the other way than "
        "most tables of coefficients have it. To decide, push the dynamometer by hand along its axis"
    )
    return (Slip((), f"with the force as declared {found}", remedy, best.file, best.column),)


def _deciding(cutter: Cutter) -> float:
    """Return the helix, rad, where it decides the sign of the axial force, else 0.

    A corner or an inclined flank turns the radial force towards the axis.
    """
    return cutter.helix if cutter.cylindrical else 0.0


def _with_ends(records: list[Record], ends: Sequence[Cutter], sensor: JSON) -> Iterator[Hypothesis]:
    """Yield the orientations, the declared one first, of a tool with each of other ends."""
    for end in ends:
        designs = [design(end, record.setting) for record in records]
        shape = "a ball end" if end.corner == end.radius else f"a corner radius of {end.corner / MM:.3g} mm"
        yield Hypothesis(END, f"tool: {shape}", "tool.end", records, designs)
        for one in orientation.orientations(sensor, records, designs):
            yield replace(one, kind=AXES_AND_END, remedy=f"{one.remedy} with {shape} of the tool")


def _hypotheses(
    records: list[Record], designs: list[Design], cutter: Cutter, sensor: JSON, declared: WaveFit
) -> Iterator[Hypothesis]:
    """Yield every slip of the list."""
    yield from orientation.orientations(sensor, records, designs)
    yield from chip_geometry.teeth(cutter, records)
    yield from chip_geometry.directions(cutter, records)
    yield from chip_geometry.single_directions(cutter, records, designs)
    yield from channels.gains(sensor, records, designs)
    yield from run_table.exchanged(records, designs, declared)


def _of_another_size(declared: WaveFit, faults: tuple[str, ...], factor: float) -> Slip:
    """Return what is to be checked where the waveforms are those of the cuts, and all have another size."""
    size = f"{factor:.2g} times too large" if factor > 1.0 else f"{1.0 / factor:.2g} times too small"
    return Slip(
        OBSERVABLES,
        f"with the force as declared {'; '.join(faults)}. This is impossible",
        f"The shape of the force is that of these cuts (waveform error {100 * declared.misfit:.3g} %), but "
        f"all channels are at least {size}. Check the unit of the force columns (N, kN, mN) and the "
        "sensitivity of the amplifier",
        column=channels.COLUMN,
    )


def _slip(declared: WaveFit, faults: tuple[str, ...], named: list[Tried], chip: float) -> Slip:
    found = f"with the force as declared, the waveform error is {100 * declared.misfit:.3g} % of the signal"
    if faults:
        found = f"with the force as declared {'; '.join(faults)}. This is impossible"
    if not named:
        remedy = (
            "None of the usual mistakes explains it: check axes, reads and the sensitivity of each channel "
            "of the dynamometer, and the tool (a ball end or a corner radius cuts with other forces)"
        )
        return Slip(OBSERVABLES, found, remedy, column=orientation.COLUMN)
    texts = [f"{one.hypothesis.remedy} ({_fits(one.fitted, declared, chip)})" for one in named]
    first = named[0].hypothesis
    where = "" if first.file == "batch.yaml" else f" in {first.file}"
    remedy = f"Likely{where}: {texts[0]}"
    if len(named) > 1:
        remedy += f". The records cannot distinguish this from: {'; '.join(texts[1:])}"
        ends = any(one.hypothesis.kind == AXES_AND_END for one in named)
        how = ", count the teeth, or look at the tool's end" if ends else ", or count the teeth"
        remedy += f". To decide, push the dynamometer by hand along each axis{how}"
    return Slip(OBSERVABLES, found, remedy, first.file, first.column)


def _fits(fitted: WaveFit, declared: WaveFit, chip: float) -> str:
    errors = f"waveform error {100 * fitted.misfit:.3g} % against {100 * declared.misfit:.3g} %"
    return f"with {coefficients_text(fitted.mean, chip)} and {errors}"


def speed_slips(batch: Batch, read: Tables) -> tuple[Slip, ...]:
    """Compare the speed in each force record with the run table."""
    teeth = (batch.manifest.get("tool") or {}).get("teeth")
    if not teeth:
        return ()
    runs = batch.with_files("dynamometer")
    found = {run: passes for run in runs if (passes := _passes(batch, read, run, teeth))}
    if not found:
        return ()
    named = ", ".join(list(found)[:MOST_NAMED]) + (
        f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    )
    first, passes = next(iter(found.items()))
    rpm = float(batch.runs["spindle_rpm"][first])
    text = (
        f"run{'s' * (len(found) > 1)} {named}: the force of {first} repeats {passes:.4g} times in a "
        f"revolution of {rpm:g} rpm, which no cutter of {teeth} {'tooth' if teeth == 1 else 'teeth'} does"
    )
    rates = {"once in a revolution": passes}
    if teeth > 1:
        rates = {f"with each of {teeth} teeth, which are alike": passes / teeth} | rates
    speeds = " or ".join(f"{rpm * ratio:.5g} (it repeats {how})" for how, ratio in rates.items())
    remedy = f"Likely in runs.csv: spindle_rpm is {speeds}"
    if len(found) == len(runs) and _spread(found) < 0.02:
        factors = " or ".join(f"{ratio:.3g}" for ratio in rates.values())
        remedy += f"; or the time of the records (rate_hz, column t_s) runs {factors} times too fast"
    return (Slip(OBSERVABLES, text, remedy, "runs.csv", "spindle_rpm", first),)


def _spread(found: Mapping[str, float]) -> float:
    values = np.array(list(found.values()))
    return float(np.ptp(values) / values.mean())


def _passes(batch: Batch, read: Tables, run: str, teeth: int) -> float | None:
    """Repeats per declared revolution of a run's record, where no cutter has as many; None else."""
    row: Any = batch.runs.loc[run]
    if row["stable"] == "no":  # the force of a cut that chatters repeats as the vibration does
        return None
    # in a hole the feed turns against the spindle: the teeth pass it as fast as both together
    record, rpm = LongRecord(read, run), float(row["spindle_rpm"]) + or_zero(float(row["orbit_rpm"]))
    if record.samples < 100 or not rpm > 0.0:
        return None
    middle = slice(record.samples // 4, record.samples - record.samples // 4)
    stretch = next(iter(record.stretches(middle)))
    if np.isfinite(stretch.tacho).all():
        return None
    found = period(stretch.signal, record.rate, 60.0 / rpm)
    passes = None if found is None else repeats_per_revolution(found, 60.0 / rpm, teeth)
    if found is None or passes is None:
        return None
    as_declared = turns_as_declared(stretch.signal, record.rate, 60.0 / rpm, found, teeth)
    return None if as_declared else passes
