"""Where many functions vanish, each within its bracket, all at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from metro.units import Array

Indices = npt.NDArray[np.intp]
STEPS = 20  # at most


def roots(
    value: Callable[[Array, Indices | slice], Array], at_zero: Array, at_one: Array, near: Array
) -> Array:
    """Where functions (n,) vanish between 0 and 1, at which their values have unlike signs.

    By inverse quadratic interpolation through the ends of the bracket and the point that it lost last, or at
    the bracket's middle where that leads out of it. Near the root the error of a step is of the order of the
    product of the errors of the three points, so that one after a step of less than ``near`` (n,) is much
    less. ``value`` takes places and which of the functions.
    """
    root = at_zero / (at_zero - at_one)
    some: Indices | slice = slice(None)
    a, b, fa, fb = np.zeros_like(root), np.ones_like(root), at_zero, at_one
    for _ in range(STEPS):
        x = root[some].copy()
        fx = value(x, some)
        crossed = fx * fb < 0.0
        c, fc = np.where(crossed, a, b), np.where(crossed, fa, fb)
        a, fa, b, fb = np.where(crossed, b, a), np.where(crossed, fb, fa), x, fx
        with np.errstate(divide="ignore", invalid="ignore"):
            step = fb / (fa - fc) * ((a - b) * fc / (fa - fb) - (c - b) * fa / (fc - fb))
        inside = (step * (a - b) >= 0.0) & (np.abs(step) <= np.abs(a - b))
        step = np.where(fb == 0.0, 0.0, np.where(inside, step, 0.5 * (a - b)))
        root[some] = b + step
        left = np.abs(step) >= near[some]
        if not left.any():
            break
        if 2 * np.count_nonzero(left) < len(left):
            some = np.arange(len(root))[some][left]
            a, fa, b, fb = a[left], fa[left], b[left], fb[left]
    return root
