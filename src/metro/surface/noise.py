"""What measurement noise does to flatness indices, and where its standard deviation comes from.

A maximum over 350 000 noisy points is biased up by several standard deviations, and by how much depends on
the number of points; a mean or rms is biased by quadrature. The expectations here are exact for independent
noise: no random draws.
"""

from __future__ import annotations

import numpy as np

from metro.surface.plane import fit_plane
from metro.units import Array

BINS = 300
NODES = 200  # even, so that none is at zero, where ln |d| is not defined
LEVELS = 160


def contrasts(scans: int) -> Array:
    """Return weights (scans − 1, scans) of what differs between scans: orthonormal, free of what all share.

    Each contrast has the noise of one scan, independent of that of the others; the differences of one scan
    from the next are not independent (they overlap).
    """
    from scipy.linalg import helmert

    return np.asarray(helmert(scans))


def repeat_sigma(*scans: Array) -> float:
    """Return the noise of a scan from two or more of the same points, (n, 3), planes apart from each other.

    Raises
    ------
    ValueError
        Where they do not all hold the same number of points, more than three.
    """
    first, sizes = scans[0], [len(scan) for scan in scans]
    if len(set(sizes)) > 1 or len(first) <= 3:
        counts = " and ".join(map(str, sizes))
        raise ValueError(f"repeat scans need the same points, more than three: found {counts}")
    plane = fit_plane(first)
    basis = np.column_stack([np.ones(len(first)), plane.coordinates(first)])
    differ = contrasts(len(scans)) @ np.array([(scan - first) @ plane.normal for scan in scans])
    residual = differ.T - basis @ np.linalg.lstsq(basis, differ.T, rcond=None)[0]
    return float(np.sqrt(np.sum(residual**2) / (len(residual) - 3) / residual.shape[1]))


def shrink(deviations: Array, sigma: float) -> Array:
    """Scale ``deviations`` so that their mean square loses ``sigma``²: estimates the surface under noise."""
    mean_square = float(np.mean(deviations**2))
    kept = max(0.0, 1.0 - sigma**2 / mean_square) if mean_square else 0.0
    return deviations * float(np.sqrt(kept))


def noise_bias(surface: Array, sigma: float, count: float, peaks: float) -> dict[str, tuple[float, float]]:
    """Return index → (bias, standard deviation) when noise is added to ``surface``.

    Parameters
    ----------
    surface : (n,) true deviations; only their distribution matters.
    sigma : standard deviation of the independent noise, in their unit.
    count : number of independent readings. peaks : number of those that the extremes are taken of.

    Returns
    -------
    xm, peak, valley : of the extremes, by ``P(max < t) = Π Φ((t − h_i)/σ)``.
    xa, xg, xq : of mean |d|, exp(mean ln |d|) and rms.
    """
    if sigma <= 0:
        return dict.fromkeys(("xm", "peak", "valley", "xa", "xg", "xq"), (0.0, 0.0))
    heights, share = _histogram(surface)
    peak, peak_sd = _maximum(heights, share * peaks, sigma)
    valley, valley_sd = _maximum(-heights, share * peaks, sigma)
    peak, valley = (
        peak - float(heights.max()),
        valley + float(heights.min()),
    )  # both binned: no noise, no bias
    return {
        "xm": (peak + valley, float(np.hypot(peak_sd, valley_sd))),
        "peak": (peak, peak_sd),
        "valley": (valley, valley_sd),
        **_mean_biases(heights, share, sigma, count),
    }


def _histogram(surface: Array) -> tuple[Array, Array]:
    """Mean height and share of the points in each occupied one of equal classes."""
    low, width = float(surface.min()), float(np.ptp(surface)) or 1.0
    number = np.minimum((surface - low) * (BINS / width), BINS - 1).astype(np.intp)
    count = np.bincount(number, minlength=BINS)
    total = np.bincount(number, weights=surface, minlength=BINS)
    occupied = count > 0
    return total[occupied] / count[occupied], count[occupied] / len(surface)


def _maximum(heights: Array, number: Array, sigma: float) -> tuple[float, float]:
    """Mean and deviation of the largest of ``number`` (b,) noisy readings at each of ``heights`` (b,)."""
    from scipy.special import log_ndtr

    top = heights.max()
    near = heights > top - 16 * sigma  # lower ones have no part in the maximum
    heights, number = heights[near], number[near]
    level = np.linspace(max(heights.min() - 4 * sigma, top - 7 * sigma), top + 9 * sigma, LEVELS)
    below = np.exp(log_ndtr((level[:, None] - heights) / sigma) @ number)  # P(max < level)
    mean = level[-1] - np.trapezoid(below, level)
    # about the top, where the squares do not cancel
    square = 81 * sigma**2 - np.trapezoid(2 * (level - top) * below, level)
    return float(mean), float(np.sqrt(max(square - (mean - top) ** 2, 0.0)))


def _mean_biases(heights: Array, share: Array, sigma: float, count: float) -> dict[str, tuple[float, float]]:
    from scipy.special import ndtri

    noise = sigma * ndtri((np.arange(NODES) + 0.5) / NODES)
    size = np.abs(heights[:, None] + noise)
    tiny = np.finfo(float).tiny
    log_before = share @ np.log(np.maximum(np.abs(heights), tiny))
    logs = np.log(np.maximum(size, tiny))
    log_after = share @ logs.mean(axis=1)
    xa, xg = share @ size.mean(axis=1), float(np.exp(log_after))
    before = float(np.sqrt(share @ heights**2))
    after = float(np.hypot(before, sigma))
    root = np.sqrt(count)
    return {
        "xa": (float(xa - share @ np.abs(heights)), float(sigma / root)),
        "xg": (xg - float(np.exp(log_before)), float(xg * np.sqrt(share @ logs.var(axis=1)) / root)),
        "xq": (after - before, float(sigma * np.sqrt(before**2 + sigma**2 / 2) / after / root)),
    }
