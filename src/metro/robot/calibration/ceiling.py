"""How much of what a calibrated arm leaves any cause could explain, and of which kind that is.

The residual is taken as a sum of random functions: of one joint's angle alone (what a gear or an encoder
does), of the pose (what links, bearings and loads do), of time, of temperature, and of what does not repeat.
Their variances are those by which the products of the residuals of pairs of poses are described best (Haseman
& Elston, Behav. Genet. 2 (1972) 3), none below zero. With them, poses are predicted from others: what that
explains is a ceiling for causes, whatever they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from metro.robot.calibration import measured
from metro.robot.calibration.fit import Fit, predicted
from metro.robot.calibration.model import jacobian, turning
from metro.robot.calibration.poses import Poses, evenly
from metro.units import DEG, Array

POSE, TIME, TEMPERATURE, ALONE = "pose", "time", "temperature", "alone"
SEEDS, NEIGHBOURS = 100, 8  # poses that are taken with those next to them: 800, of which pairs are near
OF_JOINT = 1.0 * DEG  # over which a joint's own error stays alike: a quarter of the spacing of curves' knots
OF_SHIFT = 0.005  # m, of a joint that shifts
OF_POSE = 0.3  # rad of the joint that moves the point most
OF_SPAN = 0.1  # of the range of time or temperature
FAR = 3.0  # scales from which on a residual counts as so large: a few poses far out decide nothing
FOLDS = 5
BLOCK = 100  # poses whose pairs are in memory at a time


@dataclass(frozen=True)
class Ceiling:
    """What could be explained of the residual.

    Attributes
    ----------
    parts : share of its power by kind, ``joint 1`` …, ``alone`` being what does not repeat.
    share : of the power, predicted of poses left out at random, with ``ci95`` by regions of the workspace.
    noise_share : that the instrument makes by its stated standard deviation; None where none is stated.
    """

    parts: Mapping[str, float]
    share: float
    ci95: tuple[float, float]
    noise_share: float | None


@dataclass(frozen=True, eq=False)
class _Kind:
    """A random function over poses: values that are alike at close coordinates, along a direction each.

    Attributes
    ----------
    at : (m, k) coordinates in lengths over which values stay alike. turn : whether they are angles that
        close after ``turn`` lengths; 0: they do not. along : (m, d) what a unit value does to what is seen,
        scaled to a mean square of d; None: as much to each of the ``dims``, independently.
    """

    name: str
    at: Array
    turn: float = 0.0
    along: Array | None = None
    dims: int = 3

    def covariance(self, some: np.ndarray | slice, others: np.ndarray | slice) -> Array:
        """Return the covariance (a, d, b, d) of some poses with others, for a variance of 1."""
        apart = self.at[some, None] - self.at[None, others]
        if self.turn:
            apart = (apart + self.turn / 2) % self.turn - self.turn / 2
        alike = np.exp(-np.sqrt(np.sum(apart**2, axis=2)))
        if self.along is None:
            return np.asarray(alike[:, None, :, None] * np.eye(self.dims)[None, :, None, :])
        return np.asarray(np.einsum("ab,ai,bj->aibj", alike, self.along[some], self.along[others]))


def ceiling(fit: Fit, poses: Poses) -> Ceiling:
    """Return the ceiling of what a fit leaves of poses."""
    poses = poses.first
    own = poses.of(_with_neighbours(fit, poses))
    at, q = predicted(fit.state, fit.effects, fit.values, own)
    residuals = measured.residuals(fit.state, at, own)
    dims = residuals.shape[1]
    size = np.linalg.norm(residuals, axis=1, keepdims=True)
    far = FAR * np.sqrt(dims * (fit.scale**2 + own.sigma[:, None] ** 2))
    residuals = residuals * np.minimum(1.0, far / np.maximum(size, 1e-12))
    moves = turning(fit.state, jacobian(fit.state, q)[1])
    kinds = tuple(_kinds(fit, own, measured.seen(fit.state, at, own, moves)))
    power = float(np.mean(residuals**2))
    variances = _variances(kinds, residuals)
    alone = max(power - float(variances.sum()), 1e-3 * power)
    share, ci95 = _unseen_share(kinds, variances, alone, residuals, own.regions)
    whole = float(variances.sum()) + alone
    parts = {kind.name: float(v) / whole for kind, v in zip(kinds, variances, strict=True)}
    parts = dict(sorted(parts.items(), key=lambda one: -one[1]))
    stated = bool((own.sigma > 0.0).all())
    noise = min(1.0, float(np.mean(own.sigma**2)) / power) if stated else None
    return Ceiling(parts | {ALONE: alone / whole}, share, ci95, noise)


def _levers(fit: Fit, poses: Poses) -> Array:
    """Return how much each joint moves the point (n,), rms, over that of the joint that moves it most."""
    moves = turning(fit.state, jacobian(fit.state, poses.q)[1])
    size = np.sqrt(np.mean(np.sum(moves**2, axis=1), axis=0))
    return np.asarray(np.where(fit.state.prismatic, 1.0, size / size[~fit.state.prismatic].max(initial=1e-9)))


def _with_neighbours(fit: Fit, poses: Poses) -> np.ndarray:
    """Return the numbers of poses spread over the series and of those next to each in its joints."""
    from scipy.spatial import KDTree

    places = poses.q * _levers(fit, poses.thinned(SEEDS))
    seeds = places[evenly(len(poses), SEEDS)]
    near = KDTree(places).query(seeds, k=min(NEIGHBOURS, len(poses)))[1]
    return np.unique(near)


def _kinds(fit: Fit, poses: Poses, moves: Array) -> Iterator[_Kind]:
    """Yield the kinds that these poses can show; ``moves`` (m, d, n) of the joints, as seen."""
    dims = moves.shape[1]
    size = np.sqrt(np.mean(np.sum(moves**2, axis=1), axis=0))
    for joint, shifts in enumerate(fit.state.prismatic):
        if np.ptp(poses.q[:, joint]) > 0.0 and size[joint] > 1e-3 * size.max():
            length = OF_SHIFT if shifts else OF_JOINT
            turn = 0.0 if shifts else 2.0 * np.pi / length
            along = np.sqrt(dims) * moves[:, :, joint] / size[joint]
            yield _Kind(f"joint {joint + 1}", poses.q[:, [joint]] / length, turn, along)
    yield _Kind(POSE, poses.q * _levers(fit, poses) / OF_POSE, dims=dims)
    for name, values in ((TIME, poses.time), (TEMPERATURE, poses.temperature)):
        if np.isfinite(values).all() and np.ptp(values) > 0.0:
            yield _Kind(name, values[:, None] / (OF_SPAN * np.ptp(values)), dims=dims)


def _variances(kinds: tuple[_Kind, ...], residuals: Array) -> Array:
    """Return variances of the kinds that describe products of residuals of different poses best."""
    from scipy.optimize import nnls

    count = len(residuals)
    normal, right = np.zeros((len(kinds), len(kinds))), np.zeros(len(kinds))
    everyone = slice(None)
    for first in range(0, count, BLOCK):
        some = np.arange(first, min(first + BLOCK, count))
        parts = np.stack([kind.covariance(some, everyone) for kind in kinds])
        parts[:, np.arange(len(some)), :, some] = 0.0  # a pose with itself is the part that does not repeat
        flat = parts.reshape(len(kinds), -1)
        normal += flat @ flat.T
        right += flat @ np.einsum("ai,bj->aibj", residuals[some], residuals).ravel()
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    root = np.linalg.cholesky(normal / np.outer(scale, scale) + 1e-9 * np.eye(len(kinds)))
    return np.asarray(nnls(root.T, np.linalg.solve(root, right / scale))[0] / scale)


def _unseen_share(
    kinds: tuple[_Kind, ...], variances: Array, alone: float, residuals: Array, region: np.ndarray
) -> tuple[float, tuple[float, float]]:
    """Share of the power that is predicted of poses left out in turn; interval by jackknife over regions."""
    from scipy.linalg import cho_factor, cho_solve
    from scipy.stats import t

    count, dims = residuals.shape
    used = [(kind, v) for kind, v in zip(kinds, variances, strict=True) if v > 0.0]
    left = residuals.copy()
    if used:
        everyone = np.arange(count)
        whole = sum(v * kind.covariance(everyone, everyone).reshape(dims * count, -1) for kind, v in used)
        fold = np.repeat(np.random.default_rng(0).permutation(count) % FOLDS, dims)
        for one in range(FOLDS):
            out, rest = fold == one, fold != one
            factor = cho_factor(whole[np.ix_(rest, rest)] + alone * np.eye(int(rest.sum())))
            known = cho_solve(factor, residuals.ravel()[rest])
            left.reshape(-1)[out] -= whole[np.ix_(out, rest)] @ known
    names = np.unique(region)
    after, before = (
        np.array([np.sum(each[region == one] ** 2) for one in names]) for each in (left, residuals)
    )
    share = 1.0 - float(after.sum() / before.sum())
    shares = 1.0 - (after.sum() - after) / (before.sum() - before)
    error = float(np.sqrt((len(names) - 1) / len(names) * np.sum((shares - shares.mean()) ** 2)))
    half = float(t.ppf(0.975, len(names) - 1)) * error
    return share, (share - half, min(share + half, 1.0))
