"""Signals in MATLAB files: vectors of numbers as variables, or as fields of a structure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from metro.formats import matlab_file, matlab_hdf5
from metro.formats.channels import Channel, channel_pieces
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.matlab_file import COMPLEX, Variable

STARTS = (matlab_file.START, *matlab_hdf5.STARTS)


def mat_pieces(path: Path, kind: Kind, rows: int | None) -> Iterator[Raw]:
    """Read the vectors that are columns of a kind in pieces; other variables are ignored.

    Units that names do not contain are in a structure ``units``, a text per channel: ``units.Fx = 'kN'``.

    Raises
    ------
    FormatError
        As :func:`metro.formats.channels.channel_pieces`, and where the file is damaged, cut off or unpacks to
        more than a recording can be, or points to other files.
    """
    with mat_channels(path, kind.title) as channels:
        yield from channel_pieces(path, kind, channels, rows)


@contextmanager
def mat_channels(path: Path, title: str) -> Iterator[list[Channel]]:
    """Open a file and give all its variables that are no texts and no structures.

    Raises
    ------
    FormatError
        As :func:`mat_pieces`.
    """
    with path.open("rb") as stream:
        head = stream.read(len(matlab_file.START))
    if head == matlab_file.START:
        yield _channels(list(matlab_file.variables_of(path, title)))
        return
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            yield _channels(list(matlab_hdf5.variables_of_hdf5(path, file)))
    except FormatError:
        raise
    except Exception as error:  # of a damaged file, HDF5 raises whatever the damage makes it stumble over
        message = f"is damaged or ends early: {error or type(error).__name__}; save it again with '-v7.3'"
        raise FormatError(path, message) from error


def _channels(variables: Sequence[Variable]) -> list[Channel]:
    units = {
        one.name.lower(): one.text
        for each, _ in _walk(variables)
        if each.name.lower() == "units"
        for one in each.fields
        if one.text is not None
    }
    return [
        _channel(each, prefix, units.get(each.name.lower(), ""))
        for each, prefix in _walk(variables)
        if not each.fields and each.text is None
    ]


def _walk(variables: Sequence[Variable]) -> Iterator[tuple[Variable, str]]:
    """Yield variables and the fields of structures among them, with the prefix of their name."""
    for each in variables:
        yield each, ""
        if each.name.lower() != "units":
            yield from ((one, f"{each.name}.") for one in each.fields)


def _channel(one: Variable, prefix: str, unit: str) -> Channel:
    numeric = one.kind == "numbers"
    label = f"variable {prefix}{one.name}" + ("" if numeric else f" ({one.kind})")
    return Channel(label, one.name, unit, one.shape, numeric, one.load, pairs=one.kind == COMPLEX)
