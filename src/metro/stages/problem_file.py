"""The problems of a batch as ``identify`` posed them, with the fits of their base models, for later stages.

A problem is posed and its base model fitted once. The file is a pickle, since a problem is made of models and
arrays of many kinds. It may name what the rooms of physics, observables and the loop define, and what arrays
are made of: nothing of that reads or writes, or runs code that a file holds. It also holds the hash of the
code that it names: a stage that reads the file runs that code without importing it, and has to run again
where it changed.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from metro.batch.writing import write_atomically
from metro.codehash import hash_of
from metro.observables.task import Task

if TYPE_CHECKING:
    from metro.loop.fitting.fit import Fit

FILE = "problems.pickle"
ROOMS = ("observables", "loop", "effects", "cutting", "dynamics", "robot", "surface", "signals", "structure")
PLAIN = {
    "numpy": {"dtype", "ndarray"},
    "numpy._core.multiarray": {"_reconstruct", "scalar"},
    "numpy._core.numeric": {"_frombuffer"},
    "scipy.sparse._csr": {"csr_array"},
    "builtins": {"complex", "frozenset", "range", "set", "slice"},
    "collections": {"OrderedDict"},
    "functools": {"partial"},
    "types": {"MappingProxyType"},
}


@dataclass(frozen=True, eq=False)
class Posed:
    """The task of an observable, and the fit of its base model on the identification runs.

    ``base`` is None where nothing is fitted. ``printed``: measured and predicted are printed values, of which
    nothing is identified. ``unobserved``: there is no observed table to pose a problem from.
    """

    task: Task
    base: Fit | None = None
    printed: bool = False
    unobserved: bool = False


def write_problems(folder: Path, posed: Mapping[str, Posed]) -> None:
    """Write the problems of a batch, by observable; what was written can be read."""
    content = pickle.dumps(dict(posed), protocol=pickle.HIGHEST_PROTOCOL)
    reading = _Restricted(io.BytesIO(content))
    reading.load()
    code = hash_of(*sorted(reading.modules)).encode()
    write_atomically(folder / FILE, lambda stream: stream.write(content + code))


def read_problems(folder: Path) -> dict[str, Posed]:
    """Read what :func:`write_problems` wrote.

    Raises
    ------
    pickle.UnpicklingError
        The file names something that no problem is made of.
    """
    problems: dict[str, Posed] = _Restricted(io.BytesIO((folder / FILE).read_bytes())).load()
    return problems


class _Restricted(pickle.Unpickler):
    """An unpickler that knows what problems are made of, and nothing else.

    Attributes
    ----------
    modules : modules of this package that the file names.
    """

    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream)
        self.modules: set[str] = set()

    def find_class(self, module: str, name: str) -> Any:
        package, _, inner = module.partition(".")
        ours = package == "metro" and (inner.split(".")[0] in ROOMS or module == __name__)
        self.modules |= {module} if ours else set()
        if ours or name in PLAIN.get(module, ()):
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"{FILE} names {module}.{name}, which no problem is made of")
