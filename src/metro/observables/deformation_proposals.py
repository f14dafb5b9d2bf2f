"""Walls and load tests that could be made next, to part what the joints of an arm do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from metro.observables.cutting_force import turn_about_z
from metro.observables.deformation_blocks import ZERO, PerNewton, force_error
from metro.observables.deformation_model import CutWall, LoadTest
from metro.observables.problem import Block, Made, Proposal
from metro.robot.kinematics import Arm
from metro.units import DEG, Array

MEASURED = 0.01  # relative error of a force that a dynamometer reads
SHALLOW, DEEP = 0.5, 2.0  # depths of walls, of that of the run they are like
HEAVIER = 2.0  # load tests, of the largest force so far
LOADED = "load tests "  # what the name of such a block begins with; then comes the pose
TURNS = (0.0, 90.0 * DEG)  # of the feed; half a turn loads the joints the other way and shows the same


def feasible(
    walls: Sequence[Block], tests: Sequence[Block], arm: Arm, per_newton: PerNewton
) -> tuple[Proposal, ...]:
    """Return walls and load tests that could be made after those of a batch.

    Each side that was milled again, at half and at twice the depth; the same in every pose of the load tests,
    with the feed along and across; load tests with twice the force in each of their poses.

    Parameters
    ----------
    walls, tests : blocks of the batch; ``tests`` those of load tests and of joints known beforehand.
    per_newton : as of :meth:`metro.observables.deformation_model.DeformationModel.per_newton`.
    """
    loaded = [block for block in tests if isinstance(block.setting, LoadTest)]
    made = [block for block in walls if block.role == "identify"]
    return (*_walls(made, loaded, arm, per_newton), *map(_heavier, loaded))


def _walls(
    made: Sequence[Block], loaded: Sequence[Block], arm: Arm, per_newton: PerNewton
) -> Iterator[Proposal]:
    """Propose walls at two depths: a gap and a spring part by the depth, joints by pose and direction."""
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
                blocks = (_block(like, here, depth, words, per_newton) for depth in (SHALLOW, DEEP))
                given: dict[str, float | str] = {"feed_direction_deg": feed}
                given |= {"pose": pose} if pose else {}
                rows = (Made(like.run, {"axial_depth_mm": depth}, given) for depth in (SHALLOW, DEEP))
                yield Proposal(words, tuple(blocks), tuple(rows))


def _each_side(made: Sequence[Block], arm: Arm) -> list[Block]:
    """Return of each side (wall on the left or on the right of the feed) the wall that was cut deepest."""
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
    """Direction of the feed about work z, rad; of an arm that stood still that of the normal less 90°."""
    moved = arm.tip(setting.commanded[-1]) - arm.tip(setting.commanded[0])
    across = math.atan2(setting.normal[1], setting.normal[0]) - 90.0 * DEG
    return math.atan2(moved[1], moved[0]) if np.linalg.norm(moved[:2]) > 0.0 else across


def _turned(setting: CutWall, joints: Array, turn: float) -> CutWall:
    """Put a wall elsewhere: in one pose all along it, its force and its normal turned about work z."""
    still, rotation = np.tile(joints, (len(setting.force), 1)), turn_about_z(turn)
    return replace(
        setting,
        commanded=still,
        actual=still,
        rate=np.zeros_like(still),
        force=setting.force @ rotation.T,
        normal=rotation @ setting.normal,
    )


def _block(like: Block, setting: CutWall, depth: float, words: str, per_newton: PerNewton) -> Block:
    """Return the wall at a depth; the mean force is in proportion to it."""
    setting = replace(setting, force=depth * setting.force)
    name = f"proposed: {words}, {depth:g}"
    untold = np.column_stack([np.full(len(like.axis), ZERO), force_error(setting, MEASURED, per_newton)])
    return replace(like, run=name, condition=name, setting=setting, untold=untold)


def _heavier(like: Block) -> Proposal:
    setting: LoadTest = like.setting
    newton = HEAVIER * float(np.linalg.norm(setting.force, axis=1).max())
    words = f"the {like.run} again with {HEAVIER:g} times the force ({newton:.0f} N at most)"
    block = replace(
        like,
        run=f"proposed: {words}",
        condition=words,
        setting=replace(setting, force=HEAVIER * setting.force),
    )
    return Proposal(words, (block,))
