"""Whether the tip of a tabulated machine yields statically to the teeth, as [T] figure 6 takes it to.

Two things can deny it. The iteration maps an error e of the force to G e, with G = ∂F/∂q K⁻¹: where an
eigenvalue of G is one or more, a force makes a deflection that makes a larger force, and the scheme diverges.
And the teeth may pass so fast that the structure does not follow: at the frequency f of the teeth it moves by
H(f), not by H(0). Of one mode without damping H(f) = H(0) / (1 − (f/f_n)²), which is a tenth more than H(0)
from f = 0.3 f_n on.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.force.yielding_table import gains
from metro.observables.problem import Refusal
from metro.units import JSON

DIVERGES = 1.0  # gain from which on an iteration does not converge
NOT_STATIC = 0.1  # |H(f)/H(0) − 1| from which on the deflection is not the static one
NAMED = 3  # runs of a sentence


def static_deflection(batch: Batch, read: Tables, identified: JSON) -> JSON:
    """Return what denies a static deflection, with its figures; nothing where the machine has no table.

    Returns
    -------
    JSON
        ``runs`` in which it has no meaning, the largest ``iteration_gain`` of them, and, where modes are
        identified, ``tooth_hz``, ``modes_hz`` (lowest and highest), the ``position`` of the modes and
        ``moves``, |H(f)/H(0)| of the softest direction, of the run in which this differs most from 1;
        ``reason``: all this in words, "" where nothing denies it.
    """
    table = gains(batch, read, identified)
    if isinstance(table, Refusal) or table.empty:
        return {}
    rows = table.join(_moves(batch, table["run"], identified.get("modes") or []))
    rows["off"] = (rows["moves"] - 1.0).abs() > NOT_STATIC
    denied = rows.loc[np.asarray(rows["gain"] >= DIVERGES) | rows["off"].to_numpy(bool)]
    if denied.empty:
        return {"runs": [], "reason": ""}
    block: JSON = {"runs": [str(run) for run in denied["run"]], "iteration_gain": float(denied["gain"].max())}
    if denied["off"].any():
        worst = denied.loc[(denied["moves"] - 1.0).abs().idxmax()]
        names = ("tooth_hz", "moves", "lowest_hz", "highest_hz")
        tooth, moves, low, high = (float(worst[name]) for name in names)
        block |= {"tooth_hz": tooth, "modes_hz": [low, high], "moves": moves}
        block |= {"position": str(worst["position"])}
    return block | {"reason": _words(block)}


def _words(block: JSON) -> str:
    runs = block["runs"]
    named = ", ".join(runs[:NAMED]) + (f" and {len(runs) - NAMED} more" if len(runs) > NAMED else "")
    parts = []
    if block["iteration_gain"] >= DIVERGES:
        parts.append(
            "its iteration multiplies an error of the force by "
            f"{block['iteration_gain']:.3g} in each step and converges below 1 only"
        )
    if "moves" in block:
        low, high = block["modes_hz"]
        parts.append(
            f"the teeth pass at {block['tooth_hz']:.3g} Hz, where the machine (modes of position "
            f"{block['position']}, {low:.3g} to {high:.3g} Hz) moves {block['moves']:.2g} times as far as "
            "under a static force"
        )
    return (
        f"the static deflection has no meaning for {named}: {', and '.join(parts)}. The tool is taken as "
        "rigid in the force; whether it vibrates is a matter of the stability lobes"
    )


def _moves(batch: Batch, runs: pd.Series, modes: list[JSON]) -> pd.DataFrame:
    """Motion at the tooth passing over the static one, in the softest direction of the modes of a position.

    The position is that of the run where it has modes, else the first that has.
    """
    names = ["tooth_hz", "moves", "lowest_hz", "highest_hz", "position"]
    teeth = float(batch.manifest["tool"]["teeth"])
    rows = []
    for run in runs:
        tooth = teeth * float(batch.runs.loc[run, "spindle_rpm"]) / 60.0
        pose = str(batch.runs.loc[run, "pose"])
        places = [str(mode["position"]) for mode in modes]
        place = pose if pose in places else (places[0] if places else "")
        here = [mode for mode in modes if str(mode["position"]) == place]
        rows.append([tooth, *_softest(here, tooth), place])
    return pd.DataFrame(rows, columns=names, index=runs.index)


def _softest(modes: list[JSON], frequency: float) -> tuple[float, float, float]:
    """Return |H(f)/H(0)| of the softest direction, and the lowest and the highest natural frequency, Hz."""
    if not modes:
        return np.nan, np.nan, np.nan
    table = pd.DataFrame(
        {name: [mode[name]["value"] for mode in modes] for name in ("frequency", "damping", "stiffness")}
    ).assign(direction=[mode["direction"] for mode in modes])
    compliance = (1.0 / table["stiffness"]).groupby(table["direction"]).sum()
    part = table[table["direction"] == compliance.idxmax()]
    ratio = frequency / part["frequency"].to_numpy(float)
    each = 1.0 / part["stiffness"].to_numpy(float)
    moved = (each / (1.0 - ratio**2 + 2j * part["damping"].to_numpy(float) * ratio)).sum()
    return (
        float(abs(moved) / each.sum()),
        float(table["frequency"].min()),
        float(table["frequency"].max()),
    )
