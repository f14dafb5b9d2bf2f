"""Walls and load tests that could be made next, to separate the contributions of an arm's joints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from metro.observables.cut.conditions import turn_about_z
from metro.observables.deformation.blocks import SYSTEMATIC, ZERO, WallErrors
from metro.observables.deformation.setting import CutWall, LoadTest
from metro.observables.problem import Block, Made, Proposal
from metro.robot.kinematics import Arm
from metro.units import DEG, Array

MEASURED = "dynamometer"  # the source of the force on walls that are made next
SHALLOW, DEEP = 0.5, 2.0  # depths of walls, relative to the run that they vary
HEAVIER = 2.0  # force of load tests, relative to the largest force so far
LOADED = "load tests "  # the name of such a block begins with it; the pose follows
TURNS = (0.0, 90.0 * DEG)  # of the feed; half a turn only reverses the load on the joints


def feasible(
    walls: Sequence[Block], tests: Sequence[Block], arm: Arm, errors: WallErrors
) -> tuple[Proposal, ...]:
    """Return walls and load tests that could be made after those of a batch.

    They are each milled side again at half and at twice the depth, in the pose of the cuts and in every pose
    of the load tests, with the feed along and across; and load tests with twice the force in each pose.

    Parameters
    ----------
    walls, tests : blocks of the batch; ``tests`` those of load tests and of joints known beforehand.
    errors : of a wall that those of its force make.
    """
    loaded = [block for block in tests if isinstance(block.setting, LoadTest)]
    made = [block for block in walls if block.role == "identify"]
    return (*_walls(made, loaded, arm, errors), *map(_heavier, loaded))


def _walls(
    made: Sequence[Block], loaded: Sequence[Block], arm: Arm, errors: WallErrors
) -> Iterator[Proposal]:
    """Propose walls at two depths.

    The depth distinguishes a gap from a spring; pose and direction distinguish the joints.
    """
    for like in _each_side(made, arm):
        setting: CutWall = like.setting
        middle = setting.commanded[len(setting.commanded) // 2]
        towards = _heading(setting, arm)
        poses = [("the pose of the cuts", middle, "")]
        poses += [
            (f"the pose of {block.run}", block.setting.joints[0], block.run.removeprefix(LOADED))
            for block in loaded
        ]
        for place, joints, pose in poses:
            for turn in TURNS:
                here = _turned(setting, joints, turn)
                feed = round((towards + turn) / DEG) % 360
                words = (
                    f"a wall as that of {like.condition} at half and at twice the depth, in {place}, "
                    f"feed at {feed}°, with a dynamometer"
                )
                blocks = (_block(like, here, depth, words, errors) for depth in (SHALLOW, DEEP))
                given: dict[str, float | str] = {"feed_direction_deg": feed}
                given |= {"pose": pose} if pose else {}
                rows = (Made(like.run, {"axial_depth_mm": depth}, given) for depth in (SHALLOW, DEEP))
                yield Proposal(words, tuple(blocks), tuple(rows))


def _each_side(made: Sequence[Block], arm: Arm) -> list[Block]:
    """Return the wall with the largest force of each side (wall to the left or to the right of the feed)."""
    best: dict[bool, Block] = {}
    for block in made:
        setting: CutWall = block.setting
        angle = _heading(setting, arm)
        left = bool(setting.normal @ [-math.sin(angle), math.cos(angle), 0.0] > 0.0)
        if left not in best or _size(block) > _size(best[left]):
            best[left] = block
    return list(best.values())


def _size(block: Block) -> float:
    return float(np.linalg.norm(block.setting.force, axis=1).max())


def _heading(setting: CutWall, arm: Arm) -> float:
    """Direction of the feed about work z, rad; for an arm in one pose, that of the normal less 90°."""
    moved = arm.tip(setting.commanded[-1]) - arm.tip(setting.commanded[0])
    across = math.atan2(setting.normal[1], setting.normal[0]) - 90.0 * DEG
    return math.atan2(moved[1], moved[0]) if np.linalg.norm(moved[:2]) > 0.0 else across


def _turned(setting: CutWall, joints: Array, turn: float) -> CutWall:
    """Return a wall cut elsewhere: in one pose all along, with force and normal turned about work z."""
    still, rotation = np.tile(joints, (len(setting.force), 1)), turn_about_z(turn)
    return replace(
        setting,
        commanded=still,
        actual=still,
        rate=np.zeros_like(still),
        force=setting.force @ rotation.T,
        normal=rotation @ setting.normal,
        weight=None,  # in one pose neither the weight nor the gears move the tip
        waves=None,
    )


def _block(like: Block, setting: CutWall, depth: float, words: str, errors: WallErrors) -> Block:
    """Return the wall at a relative depth; the mean force is proportional to it."""
    setting = replace(setting, force=depth * setting.force)
    own = 0.0 if setting.source == MEASURED else SYSTEMATIC[MEASURED]
    setting = replace(setting, harder=errors.harder(setting), source=MEASURED)
    name = f"proposed: {words}, {depth:g}"
    unidentified = np.column_stack([np.full(len(like.axis), ZERO), errors.own(setting, own)])
    return replace(like, run=name, condition=name, setting=setting, unidentified=unidentified)


def _heavier(like: Block) -> Proposal:
    setting: LoadTest = like.setting
    newton = HEAVIER * float(np.linalg.norm(setting.force, axis=1).max())
    words = f"the {like.run} again with {HEAVIER:g} times the force ({newton:.0f} N at most)"
    block = replace(
        like,
        run=f"proposed: {words}",
        condition=words,
        setting=replace(setting, force=HEAVIER * setting.force),
        unidentified=None if like.unidentified is None else HEAVIER * like.unidentified,
    )
    return Proposal(words, (block,))
