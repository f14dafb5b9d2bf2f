"""What the cutter does to the work: the number of teeth, and up against down milling."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.slips.hypothesis import Hypothesis
from metro.slips.waveform import Design, Record, design

MOST_TEETH = 12


def teeth(cutter: Cutter, records: Sequence[Record]) -> Iterator[Hypothesis]:
    """Yield other numbers of teeth, evenly pitched; the feed per tooth stays that of the run table.

    As many teeth at the declared speed pass as often as the declared ones at another speed.
    """
    for count in range(1, MOST_TEETH + 1):
        if count != cutter.teeth:
            other = replace(cutter, tooth_angles=evenly_pitched(count))
            designs = [design(other, record.setting) for record in records]
            ratio = count / cutter.teeth
            remedy = f"teeth: {count} (or every spindle_rpm of runs.csv times {ratio:.3g})"
            yield Hypothesis("teeth", remedy, "tool.teeth", records, designs)


def directions(cutter: Cutter, records: Sequence[Record]) -> Iterator[Hypothesis]:
    """Yield up for down milling in all runs that have a direction; none where all are slots."""
    mirrored = [design(cutter, other_direction(record).setting) for record in records]
    if any(has_direction(record) for record in records):
        remedy = "exchange up and down in the column direction"
        yield Hypothesis("direction", remedy, "direction", records, mirrored, "runs.csv")


def has_direction(record: Record) -> bool:
    """Whether the arc of a cut is not its own mirror image about the direction of feed."""
    arc = record.setting.cut.engagement
    return not math.isclose(arc.entry + arc.exit, math.pi, abs_tol=1e-6)


def other_direction(record: Record) -> Record:
    """Return the record as of the cut from the other side of the tool."""
    setting = record.setting
    arc = setting.cut.engagement
    mirrored = Engagement(math.pi - arc.exit, math.pi - arc.entry, arc.exit_face, arc.entry_face)
    return replace(record, setting=replace(setting, cut=replace(setting.cut, engagement=mirrored)))


def single_directions(
    cutter: Cutter, records: Sequence[Record], designs: Sequence[Design]
) -> Iterator[Hypothesis]:
    """Yield the other direction in one run alone."""
    for place, record in enumerate(records):
        if has_direction(record):
            mirrored = [*designs]
            mirrored[place] = design(cutter, other_direction(record).setting)
            remedy = f"the other direction (up or down) in the row of {record.run}"
            yield Hypothesis("direction", remedy, "direction", records, mirrored, "runs.csv")
