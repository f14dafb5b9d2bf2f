"""Profiles and areal scans in X3P (ISO 25178-72): a ZIP archive of XML and binary heights, in metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import KINDS, Kind, Raw
from metro.formats.limits import check_archive
from metro.units import MM


def read_x3p(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read a profile or, as a cloud, a surface of one layer; checksums are verified.

    A profile is ``x_mm`` along the trace and ``z_mm``. Points without a height are left out of a surface and
    at the ends of a trace; within a trace they are an error, as in every other profile.

    Raises
    ------
    FormatError
        Where the archive is damaged or unpacks to too much, or holds neither a profile nor a surface.
    """
    import x3pio

    try:
        check_archive(path, kind.title)
        content = x3pio.read(path)
    except FormatError:
        raise
    except Exception as error:  # whatever a damaged archive makes its reader stumble over
        message = f"is not a readable X3P file: {error or type(error).__name__}"
        raise FormatError(path, message) from error
    areal = kind is KINDS["cloud"]
    if not isinstance(content, x3pio.Surface if areal else x3pio.Profile):
        content_type = type(content).__name__.lower()
        raise FormatError(path, f"found a {content_type} of ISO 25178-72, expected {kind.title}")
    if len(content.layers) != 1:
        raise FormatError(path, f"found {len(content.layers)} layers, expected one: a trace per file")
    points = np.asarray(content.layers[0].points(), dtype=np.float64).reshape(-1, 3)
    if areal:
        cloud = pd.DataFrame(points[:rows] / MM, columns=["x_mm", "y_mm", "z_mm"])
        return Raw(cloud, lambda row: f"point {row + 1}")
    measured = np.flatnonzero(np.isfinite(points).all(axis=1))
    first, last = (measured[0], measured[-1] + 1) if len(measured) else (0, 0)
    trace = points[first:last][:rows] / MM
    return Raw(
        pd.DataFrame({"x_mm": trace[:, 0], "z_mm": trace[:, 2]}), lambda row: f"point {first + row + 1}"
    )
