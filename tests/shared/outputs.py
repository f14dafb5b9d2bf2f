"""What a workflow has written, and whether all of it is whole."""

import hashlib
import json
import re

import pyarrow.parquet as pq

ROOTS = ("data/processed", "reports")
# What a failed call writes of the batches that are through, and the next call writes anew.
PARTIAL = {"reports/summary.pdf", "reports/summary.html", "reports/summary.parquet", "reports/memory.json"}
TEMPORARY = re.compile(r"^\..+\.\w{8}$")


def outputs(folder):
    """Return SHA-256 by path of every file below the folders of outputs, those being written left out."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for root in ROOTS
        for path in sorted((folder / root).rglob("*"))
        if path.is_file() and not any(TEMPORARY.match(part) for part in path.relative_to(folder).parts)
    }


def leftovers(folder):
    """Return the temporary files and folders that are there."""
    return [path for root in ROOTS for path in (folder / root).rglob(".*") if TEMPORARY.match(path.name)]


def torn(folder, reference):
    """Return the files with a final name that are neither those of an undisturbed run nor a whole summary."""
    return [
        name
        for name, digest in outputs(folder).items()
        if reference.get(name) != digest and not (name in PARTIAL and whole(folder / name))
    ]


def whole(path):
    """Tell whether a file is complete, by the end that its format has."""
    content = path.read_bytes()
    if path.suffix == ".parquet":
        return pq.read_table(path, use_threads=False) is not None
    if path.suffix == ".json":
        return isinstance(json.loads(content), dict)
    return content.rstrip().endswith({".pdf": b"%%EOF", ".html": b"</html>"}[path.suffix])


def bytes_lost(folder, reference):
    """Return the files that differ from an undisturbed run's, are missing, or are too many."""
    now = outputs(folder)
    return sorted(name for name in {*now, *reference} if now.get(name) != reference.get(name))
