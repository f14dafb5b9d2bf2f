"""Which code a stage runs, as one hash: changed code re-runs the stages that it belongs to and no others.

Snakemake does not see that a function of an installed package was edited. So each rule has among its params
the hash of its stage's code: SHA-256 over the syntax trees of the stage's module and of all that it imports
inside the package. Comments, layout and docstrings are not in the tree that is hashed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

from metro import syntax

ROOT = Path(__file__).parent
PACKAGE = "metro"
PLUGINS = "metro.effects"
# Modules that find others by themselves, so that no import statement names these: where they look.
FINDERS = {
    "metro.effects.library": "effects/**/*.py",
    "metro.observables.registry": "observables/*/observable.py",
    "metro.observables.catalogue": "observables/*/description.py",
}
LOADING = {
    "metro.effects.library",
    "metro.batch.known",
}  # modules that load what other packages offer as effects


class ChangedCodeError(RuntimeError):
    """The code is not the one that the workflow was planned with."""


def code_hash(stage: str) -> str:
    """Return the hash of the code of ``metro.stages.<stage>`` and of all that it uses inside the package.

    Parameters
    ----------
    stage : name of the stage's module.

    Returns
    -------
    64 hexadecimal digits.

    Raises
    ------
    FileNotFoundError
        There is no such stage.
    """
    start = f"{PACKAGE}.stages.{stage}"
    if _file(start) is None:
        raise FileNotFoundError(f"no stage {stage!r}: {PACKAGE}/stages/{stage}.py is not there")
    return hash_of(start)


def hash_of(*starts: str) -> str:
    """Return the hash of the code of some modules and of all that they use inside the package.

    Parameters
    ----------
    starts : dotted names of modules of the package.

    Returns
    -------
    64 hexadecimal digits.
    """
    modules = imported_modules(*starts)
    parts = [f"{name} {syntax.of_file(path).digest}" for name, path in sorted(modules.items())]
    folders = sorted({path.parent for path in modules.values()})
    parts += [f"{path.relative_to(ROOT)} {_sha256(path.read_bytes())}" for path in _data_files(folders)]
    if not LOADING.isdisjoint(modules):
        parts += _installed_plugins()
    syntax.remember()
    return _sha256("\n".join(parts).encode())


def require_code(stage: str, planned: str) -> None:
    """Refuse to run code that is not the one the workflow was planned with.

    Raises
    ------
    ChangedCodeError
        The stage's own hash differs from ``planned``.
    """
    if code_hash(stage) != planned:
        raise ChangedCodeError("the code changed since the workflow was planned: call metro run again")


def imported_modules(*starts: str) -> dict[str, Path]:
    """Return the modules of the package that some modules need, themselves included: dotted name → file.

    Imports inside functions count. Importing a module counts the packages that hold it, and what a module
    finds by itself (``FINDERS``) counts as imported by it.
    """
    modules: dict[str, Path] = {}
    seen: set[str] = set()  # most names are named often, and many are no module
    waiting = list(starts)
    while waiting:
        name = waiting.pop()
        path = None if name in seen else _file(name)
        seen.add(name)
        if path is None:
            continue
        modules[name] = path
        waiting += [*_parents(name), *_imports(path, name)]
        if name in FINDERS:
            waiting += [_dotted(module) for module in sorted(ROOT.glob(FINDERS[name]))]
    return modules


def _imports(path: Path, name: str) -> Iterator[str]:
    """Yield every dotted name that a module may be importing, modules and attributes alike."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for level, module, names in syntax.of_file(path).imports:
        above = package[: len(package) + 1 - level] if level else []
        source = ".".join([*above, *([module] if module else [])])
        yield from (source, *(f"{source}.{name}" for name in names))


def _parents(name: str) -> Iterator[str]:
    while "." in name:
        name = name.rpartition(".")[0]
        yield name


def _file(name: str) -> Path | None:
    """Return the file of a dotted name; None where it names no module of the package but, say, a function."""
    package, *parts = name.split(".")
    if package != PACKAGE:
        return None
    base = ROOT.joinpath(*parts)
    candidates = (base / "__init__.py", base.with_suffix(".py"))
    return next((path for path in candidates if path.is_file()), None)


def _dotted(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join([PACKAGE, *(parts[:-1] if parts[-1] == "__init__" else parts)])


def _data_files(folders: list[Path]) -> Iterator[Path]:
    """Yield the files of these packages that are not Python: schemas, templates."""
    for folder in folders:
        for path in sorted(folder.iterdir()):
            if path.is_dir() and path.name != "__pycache__" and not (path / "__init__.py").exists():
                yield from sorted(file for file in path.rglob("*") if file.is_file())
            elif path.is_file() and path.suffix != ".py":
                yield path


def _installed_plugins() -> list[str]:
    """Name the effects that other installed packages bring, by entry point and version."""
    points = entry_points(group=PLUGINS)
    return sorted(f"{point.name} {point.value} {point.dist and point.dist.version}" for point in points)


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
