"""Faults of whole files: empty, cut off, missing, of another kind; in every format."""

import corpus_batches as batches
import corpus_writers as writers
import numpy as np
from corpus_case import Case

PAGE = b"<!DOCTYPE html>\n<html><head><title>404 Not Found</title></head><body>Not Found</body></html>\n"
TABLES = ("runs.csv", "impacts.csv", "loads.csv", "mass.csv", "stations.csv", "published.csv")
YAMLS = ("batch.yaml", "cell.yaml")


def cases():
    """Return the cases of every format and table."""
    found = []
    for kind, forms in writers.FORMATS.items():
        for form in forms:
            found += _recording(kind, form)
    for kind in (*TABLES, *YAMLS):
        found += _described(kind)
    return found


def _content(file, data):
    return lambda folder: (folder / file).write_bytes(data)


def _noise(file):
    return _content(file, np.random.default_rng(3).integers(0, 256, 4000, np.uint8).tobytes())


def _cut(file, keep):
    """Cut a file off within its last line or block, as an interrupted copy does."""

    def apply(folder):
        data = (folder / file).read_bytes()
        at = int(len(data) * keep)
        mark = b"," if b"," in data[at:] else b"\t"
        if (
            b"\n" in data[at:] and mark in data[at:]
        ):  # behind the first field of a row, not by chance at its end
            at = data.index(mark, data.index(b"\n", at)) + 1
        (folder / file).write_bytes(data[:at])

    return apply


def _folder(file):
    def apply(folder):
        (folder / file).unlink()
        (folder / file).mkdir()

    return apply


def _link(file):
    def apply(folder):
        outside = folder.parent / "outside"
        (folder / file).rename(outside)
        (folder / file).symlink_to(outside)

    return apply


def _recording(kind, form):
    file = batches.victim(kind, form)
    other = batches.RECORDING["path" if kind != "path" else "profile"](1).to_csv(index=False).encode()
    return [
        Case(kind, form, "zero bytes", _content(file, b""), "refused", ("is empty",)),
        Case(kind, form, "blank lines alone", _content(file, b"\n\n  \n"), "refused", ("expected",)),
        Case(kind, form, "cut off half-way", _cut(file, 0.497), "flagged" if form == "RSI" else "refused"),
        Case(kind, form, "its first bytes alone", _cut(file, 0.013), "refused"),
        Case(kind, form, "noise", _noise(file), "refused"),
        Case(kind, form, "a web page was saved", _content(file, PAGE), "refused"),
        Case(kind, form, "another kind of table", _content(file, other), "refused")
        if kind not in ("scan", "profile")
        else Case(kind, form, "another kind of table", _content(file, b"a,b,c\nu,v,w\n"), "refused"),
    ] + (_named(kind, form, file) if form == next(iter(writers.FORMATS[kind])) else [])


def _named(kind, form, file):
    """Faults of the path, which are those of every format."""
    return [
        Case(kind, form, "not there", lambda f: (f / file).unlink(), "refused", ("is not there", "expected")),
        Case(kind, form, "a folder", _folder(file), "refused", ("is a folder",)),
        Case(kind, form, "a link out of the batch", _link(file), "refused", ("leads outside",)),
    ]


def _described(kind):
    found = [
        Case(kind, "", "zero bytes", _content(kind, b""), "refused", ("expected",)),
        Case(kind, "", "noise", _noise(kind), "refused"),
        Case(kind, "", "a web page was saved", _content(kind, PAGE), "refused"),
        Case(kind, "", "a folder", _folder(kind), "refused", ("is a folder",)),
    ]
    if kind in TABLES:
        second = _content(_pq(kind), b"PAR1")
        found.append(Case(kind, "", "there as Parquet, too", second, "refused", ("keep one",)))
        found.append(Case(kind, "Parquet", "damaged", _damaged(kind), "refused", ("Parquet",), _pq(kind)))
        found.append(Case(kind, "Parquet", "the same as Parquet", _as_parquet(kind), "read"))
    return found


def _pq(kind):
    return kind.replace(".csv", ".parquet")


def _damaged(kind):
    def apply(folder):
        (folder / kind).unlink()
        (folder / _pq(kind)).write_bytes(b"PAR1" + bytes(200) + b"PAR1")

    return apply


def _as_parquet(kind):
    import pandas as pd

    def apply(folder):
        pd.read_csv(folder / kind).to_parquet(folder / _pq(kind))
        (folder / kind).unlink()

    return apply
