"""Corrected joint targets: where the joints have to go for the arm to reach its targets, and how near.

A target is where the nominal arm, on its best base and with its best tool, has the point at the commanded
joints, and how it has the flange turned there. The corrected joints are those at which the calibrated arm has
both. What remains is predicted by the poses that were left out of fits: their errors over the standard
deviations that the fit expects are the distribution of errors at targets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from metro.robot.calibration.effects import PLAUSIBLE
from metro.robot.calibration.fit import Fit, columns, predicted
from metro.robot.calibration.held_out import HeldOut
from metro.robot.calibration.model import jacobian, turning
from metro.robot.calibration.poses import Poses, approached
from metro.units import Array

STEPS = 6  # each leaves less than a tenth of the error before
OF_POSITION, OF_TURN = 1e-6, 1e-4  # m, rad: to which a target is sought; the position counts before the turn
BEYOND = 1e-3  # of its range by which a joint may be beyond where it was measured


@dataclass(frozen=True, eq=False)
class Corrected:
    """Corrected targets.

    Attributes
    ----------
    q : (m, n) joints to command in place of the targets'.
    before : (m,) distance that the targets as they are miss by, as predicted, m.
    after : (m, 3) distance that is missed with the corrected ones: median, and what 95 % lie between, m.
    left, turned : (m,) what no joints take away: distance, m, and turn of the flange, rad.
    inside : (m,) whether all joints are where poses were measured.
    """

    q: Array
    before: Array
    after: Array
    left: Array
    turned: Array
    inside: np.ndarray


def corrected(q: Array, nominal: Fit, final: Fit, poses: Poses, held: tuple[HeldOut, ...]) -> Corrected:
    """Correct targets ``q`` (m, n), in the order in which they are approached.

    ``nominal``, ``final``: fits to ``poses``; ``held``: errors on poses that were left out of such fits.
    Drift, temperature and load are those of the last pose.
    """
    wanted, turns = nominal.state.position(q), nominal.state.frames(q)[0][-1][:, :3, :3]
    like = _at(q, poses)
    turns = turns @ _between(nominal, final, poses)
    before = np.linalg.norm(final.predicted(like) - wanted, axis=1)
    own = q.copy()
    for _ in range(STEPS):
        position, turn, moves, axes = _missed(final, replace(like, q=own), wanted, turns)
        rows = np.concatenate([moves / OF_POSITION, axes / OF_TURN], axis=1)
        misses = np.concatenate([position / OF_POSITION, turn / OF_TURN], axis=1)
        change = (own - q) / PLAUSIBLE
        scaled = rows * PLAUSIBLE
        square = np.swapaxes(scaled, 1, 2) @ scaled + np.eye(q.shape[1])
        pull = np.einsum("mij,mi->mj", scaled, misses) - change
        own = own + PLAUSIBLE * np.linalg.solve(square, pull[..., None])[..., 0]
    position, turn, _, _ = _missed(final, replace(like, q=own), wanted, turns)
    inside = _inside(own, poses)
    after = _expected(final, replace(like, q=own))[:, None] * _quantiles(final, poses, held, inside)
    left = np.linalg.norm(position, axis=1)
    return Corrected(own, before, np.hypot(after, left[:, None]), left, np.linalg.norm(turn, axis=1), inside)


def _at(q: Array, poses: Poses) -> Poses:
    """Return targets as poses of the day of the last one that was measured."""
    count = len(q)
    last = {name: np.full(count, getattr(poses, name)[-1]) for name in ("time", "temperature", "payload")}
    return Poses(q, np.zeros((count, 3)), np.zeros(count), came=approached(q), **last)


def _between(nominal: Fit, final: Fit, poses: Poses) -> Array:
    """Return the turn (3, 3) from the nominal last frame to the calibrated one, the mean over the poses.

    A point does not show how the last frame is turned, so that the two differ by a constant turn.
    """
    from scipy.spatial.transform import Rotation

    _, q = predicted(final.state, final.effects, final.values, poses)
    first, second = (fit.state.frames(at)[0][-1][:, :3, :3] for fit, at in ((nominal, poses.q), (final, q)))
    return np.asarray(Rotation.from_matrix(np.swapaxes(first, 1, 2) @ second).mean().as_matrix())


def _missed(final: Fit, poses: Poses, wanted: Array, turns: Array) -> tuple[Array, Array, Array, Array]:
    """Return what a pose misses: position and turn (m, 3), and what the joints do to both (m, 3, n)."""
    from scipy.spatial.transform import Rotation

    at, q = predicted(final.state, final.effects, final.values, poses)
    frames, _ = final.state.frames(q)
    _, derivatives = jacobian(final.state, q)
    moves = turning(final.state, derivatives)
    axes = np.moveaxis(frames[:-1, :, :3, 2], 0, -1) * ~final.state.prismatic
    turn = Rotation.from_matrix(turns @ np.swapaxes(frames[-1][:, :3, :3], 1, 2)).as_rotvec()
    return wanted - at, turn, moves, axes


def _inside(q: Array, poses: Poses) -> np.ndarray:
    low, high = poses.q.min(axis=0), poses.q.max(axis=0)
    spare = BEYOND * (high - low)
    return np.asarray(((q >= low - spare) & (q <= high + spare)).all(axis=1))


def _expected(final: Fit, poses: Poses) -> Array:
    """Return the standard deviation (m,) of the distance that a fit expects, m: scatter and parameters."""
    _, q = predicted(final.state, final.effects, final.values, poses)
    _, derivatives = jacobian(final.state, q, poses.point)
    parts = [derivatives[..., final.free], *columns(final.state, derivatives, final.effects, poses)]
    design = np.concatenate(parts, axis=-1)
    variance = np.einsum("mik,kl,mil->m", design, final.covariance, design, optimize=True)
    return np.asarray(np.sqrt(variance + 3.0 * final.scale**2))


def _quantiles(final: Fit, poses: Poses, held: tuple[HeldOut, ...], inside: np.ndarray) -> Array:
    """Return (m, 3) quantiles of left-out errors over what is expected: median, 2.5 % and 97.5 %.

    Those left out at random where a target is inside what was measured; else those left out by region.
    """
    found = []
    for kind in ("region", "random"):
        one = next(each for each in held if each.kind == kind)
        scores = one.distances[-1] / _expected(final, poses.of(one.which))
        found.append(np.quantile(scores, [0.5, 0.025, 0.975]))
    return np.asarray(np.array(found)[inside.astype(int)])
