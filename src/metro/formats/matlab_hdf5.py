"""Variables of MATLAB files of version 7.3, which are HDF5: data sets, and groups for structures.

Only what lies in the file itself is read: HDF5 can point to other files, which a batch must not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from metro.formats.errors import FormatError
from metro.formats.matlab_file import COMPLEX, Variable

if TYPE_CHECKING:
    import h5py

STARTS = (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n")

_OWN = ("#refs#", "#subsystem#")  # where MATLAB keeps what cells and objects hold
_LONGEST = 256  # characters of a unit
_DEEPEST, _MOST = 2, 10_000  # structures in structures; variables and fields


def variables_of_hdf5(path: Path, file: h5py.File) -> Iterator[Variable]:
    """Yield all variables of an open file; `load` reads from it.

    Raises
    ------
    FormatError
        Where a variable is a link, or its data lie in another file.
    """
    budget = count(1)
    for name in file:
        if name not in _OWN:
            yield _variable(path, file, name, budget, depth=0)


def _variable(path: Path, group: h5py.Group, name: str, budget: Iterator[int], depth: int) -> Variable:
    import h5py

    if next(budget) > _MOST:  # groups may hold one another: a small file has as many as it likes
        raise FormatError(
            path, f"found more than {_MOST} variables and fields, expected those of a recording"
        )
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise FormatError(path, f"variable {name}: is a link, expected the data themselves in the file")
    item = group[name]
    attribute = item.attrs.get("MATLAB_class", b"")
    stated = attribute.decode("ascii", "replace") if isinstance(attribute, bytes) else str(attribute)
    if isinstance(item, h5py.Dataset):
        return _of_data(path, name, item, stated)
    if not isinstance(item, h5py.Group) or depth == _DEEPEST or stated not in ("", "struct"):
        return Variable(name, kind=stated or "no numbers")
    fields = tuple(_variable(path, item, each, budget, depth + 1) for each in item)
    return Variable(name, (1, 1), "structure", fields=fields)


def _of_data(path: Path, name: str, item: h5py.Dataset, stated: str) -> Variable:
    if item.external or item.is_virtual:
        raise FormatError(path, f"variable {name}: its data lie in another file, expected them in this one")
    shape = tuple(int(size) for size in item.shape or ())
    if "MATLAB_empty" in item.attrs or item.shape is None:
        return Variable(name, (0, 0))
    if stated == "char" and item.dtype.kind == "u" and math.prod(shape) <= _LONGEST:
        return Variable(name, shape, "text", text="".join(map(chr, np.ravel(item[()]).tolist())))
    if item.dtype.kind in "iuf" and stated != "char":
        return Variable(name, shape[::-1], load=lambda some: _values(item, some))
    if item.dtype.names == ("real", "imag"):
        return Variable(name, shape[::-1], COMPLEX, lambda some: _complex(_values(item, some)))
    return Variable(name, shape, stated or "no numbers")


def _complex(pairs: np.ndarray) -> np.ndarray:
    return np.asarray(pairs["real"] + 1j * pairs["imag"])


def _values(item: Any, some: slice) -> np.ndarray:
    """Return some values of a vector, whichever of its dimensions is the long one."""
    part = item[()] if not item.shape else item[tuple(some if size > 1 else slice(1) for size in item.shape)]
    return np.ravel(part)
