"""A batch of milled faces as its manifest declares it: tool, plate, coefficients, scanner."""

import numpy as np

SIZE = (120.0, 60.0)  # mm
COEFFICIENTS = {
    "ktc_n_mm2": 900.0,
    "krc_n_mm2": 400.0,
    "kac_n_mm2": 460.0,
    "kte_n_mm": 16.0,
    "kre_n_mm": 20.0,
    "kae_n_mm": 22.0,
}


def manifest(spacing_mm, sigma_mm):
    """Manifest of a batch whose scanner has points so far apart, in error by so much."""
    return {
        "format": 1,
        "tool": {"diameter_mm": 16, "teeth": 4, "helix_deg": 30},
        "work": {"size_mm": [*SIZE, 10.0]},
        "coefficients": COEFFICIENTS,
        "instruments": {
            "scanner": {"spacing_mm": spacing_mm, "sigma_mm": sigma_mm, "to_work": np.eye(4).tolist()}
        },
    }
