"""Report on waviness: parameters, the agreement of wall and prediction, the share of each joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from metro.observables.problem import Block
from metro.observables.quantity import quantity
from metro.observables.waviness.points import GRID
from metro.surface.waves import waviness
from metro.units import JSON, MM, UM, Array

PIECE = 8 * MM  # of the wall: longer than its waves, so that the pieces are independent
DRAWS = 500
LIKE_IDLE = 4.0  # standard errors by which idle runs must correlate with cuts to identify a transfer


def waviness_of(block: Block, predicted: Array) -> JSON:
    """Return the waviness of one run, measured and predicted, with intervals by bootstrap over the wall.

    Parameters
    ----------
    block : the run. predicted : (n,) its waves by the model, m.

    Returns
    -------
    JSON
        Quantities ``wa_…, wq_…, wt_…`` of ``measured``, ``predicted`` and, if there is an idle run,
        ``idle`` (µm); ``correlation`` with the wall of prediction and idle run, ``coherence`` by band of
        wavelength, and ``joint_share`` of the tracking error's variance (their sum is one).
    """
    run = block.setting
    profiles = {
        "measured": block.to_rows(block.measured) + run.longer[0],
        "predicted": block.to_rows(predicted) + run.longer[1],
    }
    if run.idle is not None:
        profiles["idle"] = block.to_rows((run.share * run.idle).sum(axis=1)) + run.longer[1]
    drawn = _drawn(len(profiles["measured"]), block.order)
    entries: JSON = {}
    for name, profile in profiles.items():
        entries |= {f"wa_{name}": _quantity(_wa, (profile,), drawn, "um", UM)}
        entries |= {f"wq_{name}": _quantity(_wq, (profile,), drawn, "um", UM)}
        entries[f"wt_{name}"] = {"value": waviness(profile).wt / UM, "ci95": [None, None], "unit": "um"}
    measured = profiles.pop("measured")
    for name, profile in profiles.items():
        key = "correlation" if name == "predicted" else f"correlation_{name}"
        entries[key] = _quantity(_alike, (measured, profile), drawn, "1", 1.0)
    return entries | {
        "coherence": coherence(block),
        "joint_share": joint_share(run.share * run.by_joint).tolist(),
    }


def joint_share(by_joint: Array) -> Array:
    """Share (n,) of each joint in the variance of their sum: cov(joint, sum)/var(sum); they add up to one.

    A joint that moves against the others has a share below zero.
    """
    total = by_joint.sum(axis=1)
    power = float(total @ total)
    return np.asarray(by_joint.T @ total / power if power > 0.0 else np.zeros(by_joint.shape[1]))


def coherence(block: Block) -> dict[str, float]:
    """Coherence of tracking error and wall by band of wavelength: (Σxy)²/(Σx² Σy²)."""
    result, labels = {}, np.array(block.labels)
    for band in dict.fromkeys(labels.tolist()):
        x, y = block.setting.tracking[labels == band], block.measured[labels == band]
        power = float(x @ x) * float(y @ y)
        if power > 0.0:
            result[band] = float(x @ y) ** 2 / power
    return result


def transfer(blocks: Sequence[Block], other: Sequence[Array]) -> JSON:
    """Return the transfer from the tip's tracking error to the wall, over all runs, with its interval.

    It is the ratio of the wall's to the cut's readings, both by their correlation with the idle run's, which
    is an instrumental variable: neither contains its noise. So the noise of the encoders does not bias the
    ratio towards zero. The interval comes from the jackknife over runs. The transfer is unknown if idle runs
    and cuts are not correlated, because the tracking error is then below the noise.

    Parameters
    ----------
    blocks : the runs. other : of each run, (n,) the predicted waves without the tracking error, m.
    """
    sums = np.array(
        [
            (block.setting.share * block.setting.idle).sum(axis=1)
            @ np.stack([block.measured - predicted_other, block.setting.by_joint.sum(axis=1)], axis=1)
            for block, predicted_other in zip(blocks, other, strict=True)
            if block.setting.idle is not None
        ]
    ).reshape(-1, 2)
    if len(sums) < 2 or sums[:, 1].mean() < LIKE_IDLE * sums[:, 1].std(ddof=1) / np.sqrt(len(sums)):
        return quantity(np.nan, np.nan, "1")
    total = sums.sum(axis=0)
    left = total - sums
    each, count = left[:, 0] / left[:, 1], len(sums)
    sd = np.sqrt((count - 1) / count * np.sum((each - each.mean()) ** 2))
    return quantity(float(total[0] / total[1]), float(sd), "1", count - 1)


def _drawn(count: int, seed: int) -> Array:
    """Places (draws, count) of the points when pieces of the wall are drawn with replacement."""
    piece = min(max(round(PIECE / GRID), 1), count)
    pieces = -(-count // piece)
    first = np.random.default_rng(seed).integers(0, count - piece + 1, size=(DRAWS, pieces))
    return np.asarray((first[:, :, None] + np.arange(piece)).reshape(DRAWS, -1)[:, :count])


def _quantity(
    of: Callable[..., Array], profiles: tuple[Array, ...], drawn: Array, unit: str, si: float
) -> JSON:
    value = float(of(*(profile[None] for profile in profiles))[0]) / si
    low, high = np.quantile(of(*(profile[drawn] for profile in profiles)), [0.025, 0.975]) / si
    return {"value": value, "ci95": [float(low), float(high)], "unit": unit}


def _wa(profile: Array) -> Array:
    return np.asarray(np.abs(profile - profile.mean(axis=1, keepdims=True)).mean(axis=1))


def _wq(profile: Array) -> Array:
    return np.asarray(profile.std(axis=1))


def _alike(first: Array, second: Array) -> Array:
    a, b = (part - part.mean(axis=1, keepdims=True) for part in (first, second))
    size = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    return np.asarray(np.divide((a * b).sum(axis=1), size, out=np.zeros(len(a)), where=size > 0.0))
