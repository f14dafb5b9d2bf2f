"""What the tests of cloud files share: points, files as written, and what reading them gives or says."""

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, sniff

POINTS = np.array([[0.1, 0.2, 0.3], [-1.5, 2.0, 1e-3], [100.25, 60.5, 30.0], [7.0, -8.0, 9.0]])  # mm


def written(tmp_path, content, name):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def array(path):
    """Return the coordinates (n, 3) of a file that looks like a cloud and is one."""
    sniff(path, "cloud")
    table = read(path, "cloud")
    assert list(table) == ["x_mm", "y_mm", "z_mm"]
    assert (table.dtypes == np.float64).all()
    return table.to_numpy()


def failure(path):
    """Return what is said of a file that is no cloud."""
    with pytest.raises(FormatError) as caught:
        read(path, "cloud")
    return caught.value.message
