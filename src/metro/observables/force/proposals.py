"""Force runs that could be made next: variations of those of a batch, as an engineer would cut them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement, engagement
from metro.observables.force.blocks import ZERO_SHARE, zeros
from metro.observables.force.model import ForceSetting
from metro.observables.problem import Block, Made, Proposal
from metro.units import DEG, MM

LARGEST_FEED = 0.02  # per tooth, in tool diameters
SIDE_WIDTH = 0.25  # of a side cut that is proposed, in tool diameters
SLOT = Engagement(0.0, math.pi)
LONGER = 3.0
ROUNDING = 1e-9  # relative rounding by which a computed value may exceed a limit
HOLE, FACE = "a hole", "a face cut"


def feasible(
    blocks: Sequence[Block], cutter: Cutter, limits: Mapping[str, Sequence[float]] | None = None
) -> tuple[Proposal, ...]:
    """Return the runs that could be made after those of a batch, with the same tool.

    They are the first condition again, a longer cut and a record in the air. For each kind of cut in the
    batch, feed, depth, speed, side and direction of feed go beyond the cuts so far, one at a time.

    Parameters
    ----------
    blocks : all runs of the batch; those of the identification are varied. limits : by column of the run
        table, least and largest value that may be set; None: as deep as the batch went, and feeds that teeth
        usually bear.
    """
    most = {column: ends[1] * MM for column, ends in (limits or {}).items()}
    last = max(_setting(block).cut_length for block in blocks)
    made = [
        replace(block, setting=replace(_setting(block), cut_length=last))
        for block in blocks
        if block.role == "identify"
    ]
    return tuple(_proposals(made, blocks, cutter, most)) if made else ()


def _proposals(
    made: Sequence[Block], blocks: Sequence[Block], cutter: Cutter, most: Mapping[str, float]
) -> Iterator[Proposal]:
    yield from _first_again(made[0])
    kinds = dict.fromkeys(kind(block) for block in made)
    for name in kinds:
        runs = [block for block in made if kind(block) == name]
        seen = [_setting(block) for block in blocks if kind(block) == name]
        deepest = most.get("axial_depth_mm", max(_setting(block).cut.axial_depth for block in blocks))
        like = max(runs, key=_feed)
        largest = most.get("feed_per_tooth_mm", LARGEST_FEED * 2.0 * cutter.radius)
        yield from _feeds(name, runs, seen, largest)
        yield from _depths(name, runs, seen, deepest)
        yield from _speeds(name, like, seen)
        if name != HOLE:
            yield from _sides(like, kinds, cutter)
            yield from _across(name, like, seen)


def kind(block: Block) -> str:
    """Return what a run cuts, in words."""
    setting = _setting(block)
    if setting.helix is not None:
        return HOLE
    arc = setting.cut.engagement
    from_the_side, to_the_side = math.isclose(arc.entry, 0.0, abs_tol=1e-9), math.isclose(arc.exit, math.pi)
    if from_the_side and to_the_side:
        return "a slot"
    if from_the_side or to_the_side:
        return "an up-milled side cut" if from_the_side else "a down-milled side cut"
    return FACE


def _setting(block: Block) -> ForceSetting:
    setting: ForceSetting = block.setting
    return setting


def _feed(block: Block) -> float:
    return _setting(block).cut.feed_per_tooth


def _proposal(words: str, like: Block, setting: ForceSetting, made: Made | None) -> Proposal:
    """Propose a run with the noise and the zeros of the run ``like``; ``made``: its row, if it has one."""
    recording = setting.recording
    time = np.repeat(recording.middles, len(like.axis) // like.repeats)
    directions = zeros(like.axis, np.asarray(like.labels) == "mean", time, recording)
    block = replace(like, run=f"proposed: {words}", condition=words, setting=setting, zeros=directions)
    return Proposal(words, (block,), (made,) if made else ())


def _first_again(first: Block) -> Iterator[Proposal]:
    """Propose the first condition again: unchanged, longer, with a zero read in the air; and air alone."""
    setting = _setting(first)
    words = f"the first condition ({kind(first)} at {_feed(first) / MM:.3g} mm per tooth) again"
    yield Proposal(
        f"{words} at the end of the session",
        (replace(first, run="proposed: first condition again"),),
        (Made(first.run),),
    )
    rms = math.sqrt(float(np.sum(first.measured**2)) / first.repeats)
    if first.zero_sd.max() > 2.0 * ZERO_SHARE * rms:
        zeroed = replace(first, zero_sd=np.full(3, ZERO_SHARE * rms))
        yield _proposal(f"{words} with a record of the air before the cut", zeroed, setting, Made(first.run))
    if setting.helix is None:
        made = Made(first.run, {"cut_length_mm": LONGER})
        yield _proposal(f"{words}, three times as long", first, _longer(setting), made)
    recording = setting.recording
    silent = replace(
        setting,
        cut=replace(setting.cut, axial_depth=0.0),
        helix=None,
        recording=replace(recording, orbit=0.0, speed=_spindle(setting)),
    )
    words = "a record in the air, spindle turning, as long as that of a run"
    yield _proposal(words, replace(first, symmetries=None), silent, None)


def _longer(setting: ForceSetting) -> ForceSetting:
    recording = setting.recording
    middles = tuple(recording.contact + LONGER * (t - recording.contact) for t in recording.middles)
    return replace(setting, recording=replace(recording, middles=middles, span=LONGER * recording.span))


def _feeds(
    name: str, runs: Sequence[Block], seen: Sequence[ForceSetting], limit: float
) -> Iterator[Proposal]:
    """Propose feeds below and above those that were cut; the higher ones stay within what the teeth bear."""
    least, most = (choose(setting.cut.feed_per_tooth for setting in seen) for choose in (min, max))
    slow, fast = min(runs, key=_feed), max(runs, key=_feed)
    for like, feed, how in (
        (slow, 0.5 * least, "half the least"),
        (fast, 2.0 * most, "twice the largest"),
        (fast, 3.0 * most, "three times the largest"),
    ):
        if feed <= (1.0 + ROUNDING) * max(limit, least):
            words = f"{name} at {feed / MM:.3g} mm per tooth ({how} feed so far)"
            yield _fed(words, like, feed / _feed(like))


def _fed(words: str, like: Block, factor: float) -> Proposal:
    """Feed faster; in a hole the orbit and the cut of the bottom edges grow by the same factor."""
    setting = _setting(like)
    cut = replace(setting.cut, feed_per_tooth=factor * setting.cut.feed_per_tooth)
    recording, helix = setting.recording, setting.helix
    if helix is not None:
        helix = replace(helix, axial_feed=factor * helix.axial_feed)
        orbit = factor * recording.orbit
        recording = replace(recording, orbit=orbit, speed=_spindle(setting) + orbit / (2.0 * math.pi))
    setting = replace(setting, cut=cut, helix=helix, recording=recording)
    return _proposal(words, like, setting, Made(like.run, {"feed_per_tooth_mm": factor, "orbit_rpm": factor}))


def _spindle(setting: ForceSetting) -> float:
    """Spindle speed, rev/s."""
    return setting.recording.speed - setting.recording.orbit / (2.0 * math.pi)


def _depths(
    name: str, runs: Sequence[Block], seen: Sequence[ForceSetting], deepest: float
) -> Iterator[Proposal]:
    """Propose half and twice the least depth, and the largest, without those that the batch already has."""
    like = min(runs, key=lambda block: (_setting(block).cut.axial_depth, -_feed(block)))
    there = [setting.cut.axial_depth for setting in seen]
    least = min(there)
    for depth, how in (
        (0.5 * least, "half the least depth so far"),
        (2.0 * least, "twice the least depth so far"),
        (deepest, "the deepest that may be set"),
    ):
        new = not any(math.isclose(depth, other, rel_tol=0.2) for other in there)
        if new and depth <= (1.0 + ROUNDING) * deepest:
            there.append(depth)
            words = f"{name} {depth / MM:.3g} mm deep ({how})"
            yield _deep(words, like, depth / _setting(like).cut.axial_depth)


def _deep(words: str, like: Block, factor: float) -> Proposal:
    """Cut deeper; in a hole that is a steeper helix."""
    setting = _setting(like)
    cut, helix = setting.cut, setting.helix
    cut = replace(cut, axial_depth=factor * cut.axial_depth, pitch=factor * cut.pitch)
    if helix is not None:
        helix = replace(helix, pitch=factor * helix.pitch, axial_feed=factor * helix.axial_feed)
    setting = replace(setting, cut=cut, helix=helix)
    return _proposal(words, like, setting, Made(like.run, {"axial_depth_mm": factor}))


def _speeds(name: str, like: Block, seen: Sequence[ForceSetting]) -> Iterator[Proposal]:
    """Propose spindle speeds below and above those that were run, at the same feed per tooth."""
    least, most = (choose(_spindle(setting) for setting in seen) for choose in (min, max))
    for speed, how in ((0.8 * least, "0.8 of the lowest"), (1.25 * most, "1.25 of the highest")):
        factor = speed / _spindle(_setting(like))
        recording = _setting(like).recording
        recording = replace(recording, speed=factor * recording.speed, orbit=factor * recording.orbit)
        words = f"{name} at {round(60.0 * speed, -1):.0f} rpm ({how} speed so far)"
        made = Made(like.run, {"orbit_rpm": factor}, {"spindle_rpm": round(60.0 * speed, -1)})
        yield _proposal(words, like, replace(_setting(like), recording=recording), made)


def _sides(like: Block, kinds: Collection[str], cutter: Cutter) -> Iterator[Proposal]:
    """Propose the side cuts that the batch does not have, and a slot (at half the depth) if it has none."""
    setting = _setting(like)
    width = SIDE_WIDTH * 2.0 * cutter.radius
    for direction in ("up", "down"):
        name = f"a{'n' if direction == 'up' else ''} {direction}-milled side cut"
        if name not in kinds:
            arc = engagement("side", direction, width, cutter.radius)
            words = f"{name}, {width / MM:.3g} mm wide at {_feed(like) / MM:.3g} mm per tooth"
            side = replace(setting, cut=replace(setting.cut, engagement=arc), give=0.0)
            given = {"operation": "side", "direction": direction, "radial_depth_mm": width / MM}
            yield _proposal(words, like, side, Made(like.run, given=given))
    if "a slot" not in kinds:
        depth = 0.5 * setting.cut.axial_depth
        words = f"a slot {depth / MM:.3g} mm deep at {_feed(like) / MM:.3g} mm per tooth"
        cut = replace(setting.cut, axial_depth=depth, engagement=SLOT)
        given = {"operation": "slot", "direction": "slot", "radial_depth_mm": 2.0 * cutter.radius / MM}
        made = Made(like.run, {"axial_depth_mm": 0.5}, given)
        yield _proposal(words, like, replace(setting, cut=cut, give=0.0), made)


def _across(name: str, like: Block, seen: Sequence[ForceSetting]) -> Iterator[Proposal]:
    """Propose the feed turned by 90°, if no such cut goes across the others yet."""
    setting = _setting(like)
    turned = setting.feed_direction + 0.5 * math.pi
    if all(abs(math.cos(other.feed_direction - turned)) < math.sqrt(0.5) for other in seen):
        words = f"{name} at {_feed(like) / MM:.3g} mm per tooth with the feed turned by 90°"
        made = Made(like.run, given={"feed_direction_deg": turned / DEG})
        yield _proposal(words, like, replace(setting, feed_direction=turned), made)
