"""Structures and cuts that several tests share: the benchmark, the published machine, two directions."""

import numpy as np

from metro.dynamics.system import Cut, Structure

OMEGA, ZETA, MASS = 2 * np.pi * 922.0, 0.011, 0.03993


def modes(*rows):
    """Structure of rows (axis, Hz, damping, N/m)."""
    axis, hz, zeta, k = np.array(rows, dtype=float).T
    return Structure(axis.astype(int), 2 * np.pi * hz, zeta, k)


BENCH = modes((0, 922.0, ZETA, MASS * OMEGA**2))
TWO = modes((0, 41.0, 0.05, 4e6), (0, 63.0, 0.04, 3e6), (1, 35.0, 0.06, 7e6), (1, 66.0, 0.03, 5e6))

# table 6 of the published machine, position 1; what is printed as natural frequency is the damped one
PRINTED = modes(*[
    (axis, f / np.sqrt(1 - zeta**2), zeta, k)
    for axis, f, zeta, k in (
        (0, 21.3257, 0.0608951, 7.25548e6), (0, 34.6937, 0.0707726, 4.05902e6),
        (0, 56.6075, 0.035692, 4.18385e6), (0, 65.5141, 0.0633944, 2.21663e6),
        (1, 31.4277, 0.0671896, 3.1541e8), (1, 35.0952, 0.0476042, 7.06418e7),
        (1, 54.7344, 0.0499933, 4.71786e7), (1, 67.2582, 0.0379608, 1.46188e7),
    )
])  # fmt: skip

CUTS = {
    "one tooth of four at a time": Cut(4, 0.0, np.pi / 3, 1e9, 4e8),
    "one or two teeth of three": Cut(3, 0.0, np.pi, 1e9, 4e8),
    "two teeth of four, always": Cut(4, 0.0, np.pi, 1e9, 4e8),
    "two or three teeth of five": Cut(5, 0.0, np.pi, 1e9, 4e8),
    "down milling": Cut(4, 2.0, np.pi, 1e9, 4e8),
}
