"""What counts of a module's source: its syntax without docstrings, as a hash, and what it imports.

Parsing the package takes a second, which every call of the workflow and every job would pay: what was found
is kept in the user's cache folder by the content of the file.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
FORM = 2  # of what is kept; another one where other things are made of a source
MOST = 5000  # modules that are kept: more are left from versions of long ago

Entry = tuple[str, list[tuple[int, str, list[str]]]]


@dataclass(frozen=True)
class Syntax:
    """A module's hash, and its imports as written: level, source, names.

    ``import a.b`` is (0, "a.b", []), ``from ..a import b`` is (2, "a", ["b"]).
    """

    digest: str
    imports: tuple[tuple[int, str, tuple[str, ...]], ...]


@cache
def of_file(path: Path) -> Syntax:
    """Return the syntax of a Python file.

    Raises
    ------
    SyntaxError
        It is no Python.
    """
    content = path.read_bytes()
    # a syntax tree is that of a version of Python
    key = f"{FORM} {sys.version_info.major}.{sys.version_info.minor} {hashlib.sha256(content).hexdigest()}"
    if key not in _known():
        _known()[key] = _parsed(content, path)
    digest, imports = _known()[key]
    return Syntax(digest, tuple((level, source, tuple(names)) for level, source, names in imports))


def remember() -> None:
    """Keep what was parsed for the next call, where there is a folder to keep it in."""
    known = dict(list(_known().items())[-MOST:])
    if known.keys() == _kept().keys():
        return
    try:
        _file().parent.mkdir(parents=True, exist_ok=True)
        own = _file().with_suffix(f".{os.getpid()}")  # several jobs may do so at once
        own.write_text(json.dumps(known))
        own.replace(_file())
    except (OSError, RuntimeError):  # a second more at every call, and nothing else
        return
    _kept.cache_clear()


def _parsed(content: bytes, path: Path) -> Entry:
    tree = ast.parse(content, filename=str(path))
    imports: list[tuple[int, str, list[str]]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            node.body = [ast.Pass()]  # what only a type checker reads never runs
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [(0, alias.name, []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            imports.append((node.level, node.module or "", [alias.name for alias in node.names]))
        elif isinstance(node, DOCUMENTED):
            del node.body[: int(ast.get_docstring(node, clean=False) is not None)]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports


@cache
def _known() -> dict[str, Entry]:
    return dict(_kept())


@cache
def _kept() -> dict[str, Entry]:
    try:
        entries: dict[str, Entry] = json.loads(_file().read_bytes())
        return {
            str(key): (
                str(digest),
                [(int(level), str(source), [*map(str, names)]) for level, source, names in imports],
            )
            for key, (digest, imports) in entries.items()
        }
    except (OSError, ValueError, TypeError, AttributeError, RuntimeError):  # none yet, damaged, or no home
        return {}


def _import(level: int, source: str, names: list[str]) -> tuple[int, str, list[str]]:
    return int(level), str(source), [str(name) for name in names]


def _file() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "metro" / "syntax.json"
