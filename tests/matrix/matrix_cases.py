"""The cases of a batch: what is taken out of it, one thing at a time and in pairs."""

import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd
import yaml

RUN_FILES = ("dynamometer", "robot_log", "idle_log", "path", "scan", "profile", "slopes", "poses")
MEASURED = ("impacts.csv", "loads.csv", "mass.csv", "touches.csv", "payload.csv", "published.csv")
TABLES = ("runs.csv", *MEASURED, "cell.yaml", "stations.csv")
NEEDED = {"format", "batch", "source", "cell", "citation"}
SETTINGS = ("condition", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm", "direction")
ODD_NAMES = ("лауф 1", "切削-2", "a b/c", "ärger", "r'\"5", "run #6 🙂", "e\u0301", "$x^2$", "*_`", "10")


@dataclass(frozen=True)
class Case:
    """One case of the matrix: a kind, a name, and what is done to a copy of the batch."""

    kind: str
    name: str
    edit: Callable[[Path], None]


def singles(folder):
    """Yield every case in which one thing is taken out of a batch."""
    yield Case("whole", "as it is", lambda _: None)
    yield from _files(folder)
    yield from _tables(folder)
    yield from _columns(folder)
    yield from _keys(folder)
    yield from _runs(folder)


def pairs(folder, count, seed=1):
    """Return pairs of what can be taken out of a batch, drawn with a seed where there are more."""
    one = [case for case in singles(folder) if case.kind != "whole"]
    every = list(itertools.combinations(one, 2))
    drawn = every if len(every) <= count else random.Random(seed).sample(every, count)
    return [Case("pair", f"{a.name} + {b.name}", _both(a.edit, b.edit)) for a, b in drawn]


def alone(folder):
    """Yield a batch with none, one or two of the kinds of measurement that it holds."""
    there = measured(folder)
    for size in range(min(3, len(there))):
        for kept in itertools.combinations(there, size):
            gone = [each for each in there if each not in kept]
            name = f"only {', '.join(kept) or 'the description'}"
            yield Case("alone", name, lambda to, gone=gone: [_without(to, each) for each in gone])


def messy(folder):
    """Yield cases of batches that were made without a plan."""
    if (folder / "loads.csv").exists():
        yield Case("messy", "a load test of the wrong sign", lambda to: _turned(to, 1))
        yield Case("messy", "every load test of the wrong sign", lambda to: _turned(to, None))
    if not (folder / "runs.csv").exists():
        return
    for role in ("identify", "validate"):
        yield Case("messy", f"every run is to {role}", lambda to, role=role: _set(to, "role", role))
    yield Case("messy", "one condition", _one_condition)
    for answer in ("yes", "no"):
        yield Case("messy", f"every run is stable: {answer}", lambda to, a=answer: _set(to, "stable", a))
    yield Case("messy", "names of runs in any script", _odd_names)
    yield Case(
        "messy", "no role, no condition", lambda to: [_drop(to, "runs.csv", c) for c in ("role", "condition")]
    )
    yield Case("messy", "one run, to validate", lambda to: [_keep(to, 1), _set(to, "role", "validate")])
    yield Case("messy", "two runs, one of each role", lambda to: [_keep(to, 2), _roles(to)])
    yield Case("messy", "the same file for every run", _one_file)
    for operation in ("slot", "side", "face", "helical"):
        yield Case("messy", f"every run is {operation}", lambda to, o=operation: _set(to, "operation", o))


def crossed(folder, cells):
    """Yield the batch in every other cell."""
    for cell in cells:
        yield Case("cell", f"in the cell {cell.stem}", lambda to, cell=cell: _in_cell(to, cell))
    yield Case("cell", "in a cell that nobody knows", lambda to: _in_cell(to, None))


def measured(folder):
    """Return the kinds of measurement that a batch holds: columns of files, and tables."""
    there = []
    if (folder / "runs.csv").exists():
        runs = read(folder / "runs.csv")
        there = [column for column in RUN_FILES if column in runs and runs[column].ne("").any()]
    return there + [name for name in MEASURED if (folder / name).exists()]


def read(path):
    """Read a table as text."""
    return pd.read_csv(path, dtype=str, keep_default_na=False)


def _files(folder):
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.parent != folder:
            file = str(path.relative_to(folder))
            yield Case("file", f"no {file}", lambda to, file=file: (to / file).unlink(missing_ok=True))
    for table, columns in (("runs.csv", RUN_FILES), ("impacts.csv", ("file",))):
        if not (folder / table).exists():
            continue
        content = read(folder / table)
        for column in set(columns) & set(content):
            for row in range(len(content)):
                if content[column][row] and column != "file":
                    name = f"{table}: row {row + 2} without {column}"
                    edit = partial(_blank, table=table, row=row, column=column)
                    yield Case("file", name, edit)


def _tables(folder):
    for table in TABLES:
        if (folder / table).exists():
            yield Case("table", f"no {table}", lambda to, table=table: (to / table).unlink(missing_ok=True))
            if table.endswith(".csv"):
                yield Case("table", f"{table} without rows", lambda to, table=table: _head(to, table, 0))
                yield Case("table", f"{table} with one row", lambda to, table=table: _head(to, table, 1))
    for column in measured(folder):
        if column in RUN_FILES:
            yield Case("instrument", f"no {column}", lambda to, column=column: _without(to, column))


def _columns(folder):
    for table in TABLES:
        if table.endswith(".csv") and (folder / table).exists():
            for column in read(folder / table):
                edit = partial(_drop, table=table, column=column)
                yield Case("column", f"{table} without {column}", edit)


def _keys(folder):
    for file in ("batch.yaml", "cell.yaml"):
        if (folder / file).exists():
            content = yaml.safe_load((folder / file).read_text())
            for keys in _paths(content):
                if keys[0] not in NEEDED:
                    kind = "instrument" if keys[0] == "instruments" and len(keys) == 2 else "key"
                    edit = partial(_less, file=file, keys=keys)
                    yield Case(kind, f"{file} without {'.'.join(keys)}", edit)


def _runs(folder):
    if not (folder / "runs.csv").exists():
        return
    count = len(read(folder / "runs.csv"))
    for row in range(count):
        yield Case("run", f"without run {row + 1}", lambda to, row=row: _rows(to, lambda n: n != row))
        yield Case("run", f"only run {row + 1}", lambda to, row=row: _rows(to, lambda n: n == row))
    yield Case("run", "two runs", lambda to: _rows(to, lambda n: n < 2))


def _paths(content, above=()):
    for key, value in content.items():
        yield (*above, key)
        if isinstance(value, dict):
            yield from _paths(value, (*above, key))


def _both(first, second):
    def edit(to):
        first(to)
        second(to)

    return edit


def _change(to, table, change):
    if (to / table).exists():
        change(read(to / table)).to_csv(to / table, index=False)


def _blank(to, table, row, column):
    def change(content):
        if column in content and row in content.index:
            content.loc[row, column] = ""
        return content

    _change(to, table, change)


def _head(to, table, count):
    _change(to, table, lambda content: content.head(count))


def _drop(to, table, column):
    _change(to, table, lambda content: content.drop(columns=column, errors="ignore"))


def _rows(to, keep):
    _change(to, "runs.csv", lambda content: content[[keep(row) for row in range(len(content))]])


def _keep(to, count):
    _head(to, "runs.csv", count)


def _set(to, column, value):
    _change(to, "runs.csv", lambda content: content.assign(**{column: value}))


def _roles(to):
    _change(to, "runs.csv", lambda content: content.assign(role=["identify", "validate"][: len(content)]))


def _turned(to, count):
    def change(content):
        moved = content[["dx_mm", "dy_mm", "dz_mm"]].head(count)
        turned = moved.apply(pd.to_numeric).mul(-1).astype(str).replace("nan", "")
        return content.assign(**turned.reindex(content.index).fillna(content[moved.columns]))

    _change(to, "loads.csv", change)


def _one_condition(to):
    def change(content):
        return content.assign(
            **{name: content[name].iloc[0] for name in SETTINGS if name in content and len(content)}
        )

    _change(to, "runs.csv", change)
    _drop(to, "runs.csv", "role")


def _odd_names(to):
    def change(content):
        names = [f"{ODD_NAMES[i % len(ODD_NAMES)]}{'+' * (i // len(ODD_NAMES))}" for i in range(len(content))]
        return content.assign(run=names, **({"condition": names} if "condition" in content else {}))

    _change(to, "runs.csv", change)


def _one_file(to):
    def change(content):
        there = [column for column in RUN_FILES if column in content and len(content)]
        return content.assign(**{column: content[column].iloc[0] for column in there})

    _change(to, "runs.csv", change)


def _without(to, kind):
    if kind.endswith(".csv"):
        (to / kind).unlink(missing_ok=True)
    else:
        _drop(to, "runs.csv", kind)


def _less(to, file, keys):
    path = to / file
    if not path.exists():
        return
    content = yaml.safe_load(path.read_text())
    inner = content
    for key in keys[:-1]:
        inner = inner.get(key) if isinstance(inner, dict) else None
    if isinstance(inner, dict) and inner.pop(keys[-1], None) is not None:
        path.write_text(yaml.safe_dump(content, allow_unicode=True))


def _in_cell(to, cell):
    content = yaml.safe_load((to / "batch.yaml").read_text())
    content["cell"] = cell.stem if cell else "nobody-knows"
    (to / "batch.yaml").write_text(yaml.safe_dump(content, allow_unicode=True))
    (to / "cell.yaml").unlink(missing_ok=True)
