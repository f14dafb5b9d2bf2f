"""Which batch is meant: all commands take its name, or its folder among raw files, tables or results."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from metro.batch.findings import ContractError, Finding
from metro.commands.calls import CallError, wrong_call
from metro.spelling import suggestion

RAW, PROCESSED, REPORTS = Path("data/raw"), Path("data/processed"), Path("reports")
CONFIG = Path("config/config.yaml")
# The file by which a folder is that of a batch.
RAW_FILE, PROCESSED_FILE, REPORTS_FILE = "batch.yaml", "batch.json", "verdict.json"
MOST = 8  # names of batches in one message


def raw_roots(config: Path = CONFIG) -> list[Path]:
    """Return the folders of raw batches: those of config.yaml, where it says so."""
    from metro.batch.documents import read_yaml

    given = read_yaml(config, str(config))[0].get("raw_roots")
    named = [Path(root) for root in given if isinstance(root, str)] if isinstance(given, list) else []
    return named or [RAW]


def holdout(config: Path = CONFIG) -> dict[str, Any]:
    """Return the settings of the hold-out plan that the workflow has here: config.yaml's, where there is one.

    Raises
    ------
    ConfigError
        What is wrong with config.yaml.
    """
    from metro.batch.check import HOLDOUT
    from metro.batch.config import load_config

    settings: dict[str, Any] = load_config(config)["holdout"] if config.exists() else HOLDOUT
    return settings


def batch_name(given: str, processed: Path, reports: Path) -> str:
    """Return the name of a batch that has been through the workflow.

    Raises
    ------
    CallError
        There is no such batch.
    ContractError
        There is, but nothing was computed of it.
    """
    raw = raw_roots()
    name, known = _name(given, [*raw, processed, reports]), names([processed], PROCESSED_FILE)
    if name in known:
        return name
    if not known:
        raise ContractError([Finding("error", str(processed), "holds no batch yet: call metro run")])
    if name in names(raw, RAW_FILE):
        raise ContractError([Finding("error", name, "has no results yet: call metro run")])
    raise _no_such_batch(given, name, known)


def raw_folder(given: str) -> Path:
    """Return the folder of a batch's raw files; a CallError says why what was given names none."""
    path, roots = Path(given), raw_roots()
    known = names(roots, RAW_FILE)
    if path.is_file():
        near = f' (did you mean "{path.parent}"?)' if path.name == RAW_FILE else ""
        raise wrong_call(given, f"is a file, expected the folder of a batch{near}")
    if (path / RAW_FILE).is_file():
        return path
    if names([path], RAW_FILE):
        raise wrong_call(given, f"is a folder of batches (did you mean {path}/*?)")
    folder = _in(roots, RAW_FILE, _name(given, [*roots, PROCESSED, REPORTS]))
    if folder is not None:
        return folder
    if path.is_dir():
        near = suggestion(path.name, known) or "; metro import FILES makes one of a lab's files"
        raise wrong_call(given, f"holds no {RAW_FILE}: not the folder of a batch{near}")
    raise _no_such_batch(given, path.name, known)


def processed_folder(given: str) -> Path:
    """Return the folder of a batch's tables; a CallError says that there is none of what was given."""
    return _folder(given, PROCESSED, PROCESSED_FILE)


def reports_folder(given: str) -> Path:
    """Return the folder of a batch's results; a CallError says that there is none of what was given."""
    return _folder(given, REPORTS, REPORTS_FILE)


def names(roots: Iterable[Path], file: str) -> list[str]:
    """Return the names of the folders under some roots that hold a file; hidden ones are being written."""
    folders = {path.parent.name for root in roots for path in root.glob(f"*/{file}")}
    return sorted(name for name in folders if not name.startswith("."))


def _folder(given: str, root: Path, file: str) -> Path:
    if (Path(given) / file).is_file():
        return Path(given)
    raw = raw_roots()
    name = _name(given, [*raw, PROCESSED, REPORTS])
    folder = _in([root], file, name)
    if folder is not None:
        return folder
    if name in names(raw, RAW_FILE):
        raise ContractError([Finding("error", str(root / name), "is not there: call metro run")])
    raise _no_such_batch(given, name, names([root], file))


def _in(roots: Sequence[Path], file: str, name: str) -> Path | None:
    return next((root / name for root in roots if (root / name / file).is_file()), None)


def _name(given: str, roots: Sequence[Path]) -> str:
    """Return the name of the batch that a name, or a folder in one of the roots, refers to.

    A folder elsewhere refers to itself: a batch of its name that is here is another one.
    """
    path = Path(given)
    home = path.absolute().parent.resolve()
    at_home = len(path.parts) == 1 or any(home == root.resolve() for root in roots)
    return path.absolute().name if at_home else given


def _no_such_batch(given: str, name: str, known: Sequence[str]) -> CallError:
    some = f"; there are: {', '.join(known[:MOST])}{', …' if len(known) > MOST else ''}" if known else ""
    elsewhere = "/" in name  # a path is a name only in a folder of batches
    words = "is in no folder of batches here" if elsewhere else "there is no such batch"
    return wrong_call(given, f"{words}{suggestion(Path(name).name, known) or some}")
