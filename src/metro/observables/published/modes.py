"""Modes and cutting coefficients that a published batch prints, for the lobes of its machine."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.observables.stability.modal_test import MODE_COLUMNS
from metro.units import JSON

_NEEDED = ("frequency", "damping", "stiffness", "mass")


def printed_modes(published: pd.DataFrame) -> pd.DataFrame:
    """Table of the printed modes, in the columns of the identified ones; without intervals.

    The frequency is computed from stiffness and mass, because a printed natural frequency may be the damped
    one. The position is the one that the note names ("position 1"), else 1.
    """
    rows = published[(published["observable"] == "lobes") & published["quantity"].isin(_NEEDED)]
    if not set(_NEEDED) <= set(rows["quantity"]):
        return pd.DataFrame(columns=list(MODE_COLUMNS))
    position = rows["note"].astype(str).str.extract(r"position (\w+)", expand=False).fillna("1")
    keys = ["position", "axis", "row"]
    wide = rows.assign(position=position).pivot_table(
        index=keys, columns="quantity", values="measured", sort=False
    )
    wide = wide.dropna(subset=list(_NEEDED)).reset_index()
    return pd.DataFrame(
        {
            "position": wide["position"],
            "direction": wide["axis"],
            "frequency_hz": np.sqrt(wide["stiffness"] / wide["mass"]) / (2.0 * math.pi),
            "frequency_sd_hz": np.nan,
            "damping": wide["damping"] / 100.0,
            "damping_sd": np.nan,
            "stiffness_n_m": wide["stiffness"],
            "stiffness_sd": np.nan,
            "mass_kg": wide["mass"],
            "used": True,
        }
    )


def printed_coefficients(published: pd.DataFrame) -> JSON:
    """Return printed cutting coefficients (rows K_tc … K_ae) as a block ``force``; {} without any."""
    rows = published[published["quantity"] == "cutting coefficient"]
    names = rows["row"].astype(str).str.replace("_", "").str.lower()
    coefficients = {str(name): {"value": float(v)} for name, v in zip(names, rows["measured"], strict=True)}
    return {"force": {"waveform": coefficients}} if coefficients else {}
