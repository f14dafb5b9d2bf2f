"""Hysteresis that depends on the path and not on the time: Dahl's state, integrated exactly over each step.

P. Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968): dF/du = (L/w) (1 − F/L sgn u'), with the
level L and the width w over which the state turns round. Over a step in which L and w stay, F tends to ±L by
exp(−|Δu|/w). With a level that depends on the speed it is the presliding of the LuGre model (Canudas de Wit
et al., IEEE Trans. Autom. Control 40 (1995) 419).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from virtual_cell.units import Array


def dragged(steps: Array, width: ArrayLike, level: ArrayLike = 1.0, start: ArrayLike = 0.0) -> Array:
    """State (n, m) of m hysteretic elements along a path.

    Parameters
    ----------
    steps : (n, m) by how much each moves in each step. width : over which the state turns round, its unit.
    level : to which the state tends. start : (m,) of the state.
    """
    kept = np.exp(-np.abs(steps) / np.broadcast_to(width, steps.shape))
    added = np.sign(steps) * np.broadcast_to(level, steps.shape) * (1.0 - kept)
    starts = np.broadcast_to(start, steps.shape[1:])
    columns = [
        recurred(kept[:, i].tolist(), added[:, i].tolist(), float(starts[i])) for i in range(len(starts))
    ]
    return np.stack(columns, axis=1)


def recurred(kept: list[float], added: list[float], state: float) -> Array:
    """Return x (n,) of x[k] = kept[k] x[k−1] + added[k]."""
    out = []
    for share, more in zip(kept, added, strict=True):
        state = share * state + more
        out.append(state)
    return np.array(out)
