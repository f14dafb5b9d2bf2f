"""Everything that reads a file of a stranger, with a small valid sample of each."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import corpus_batches as batches
import corpus_writers as writers
import fuzz_mutations as mutations

from metro.batch.check import check
from metro.batch.discover import discover
from metro.batch.documents import read_yaml, schema_findings
from metro.batch.findings import ContractError, errors
from metro.batch.manifest import read_manifest
from metro.batch.tables import read_table
from metro.formats import FormatError
from metro.formats.registry import read, read_frfs, read_pieces, sniff

ROOT = Path(__file__).parents[2]
ROWS = 24  # of a sample: small enough that every byte is hit now and then
KINDS = {"dynamometer": "force", "robot_log": "robot", "path": "path", "profile": "profile", "scan": "cloud"}
KINDS |= {"hammer record": "record", "FRF": "frf"}
TABLES = {"runs": None, "impacts": None, "loads": batches.LOADS, "mass": batches.MASS}
TABLES |= {"published": batches.PRINTED, "stations": batches.STATIONS}


@dataclass(frozen=True)
class Target:
    """A reader.

    Attributes
    ----------
    name : what it reads.
    file : the file's name, in a folder of its own.
    sample : a valid one.
    run : reads the file in a folder; True: read, False: refused. Anything raised is a fault.
    mutate : ``(data, other, rng) -> data``.
    slow : whether it takes much longer than the others.
    """

    name: str
    file: str
    sample: bytes
    run: Callable
    mutate: Callable = mutations.damaged
    slow: bool = False


def outcome(target, folder, data):
    """Read ``data`` as the file of a target; True: read, False: refused with a message."""
    (folder / target.file).write_bytes(data)
    try:
        return target.run(folder)
    except (FormatError, ContractError):
        return False


def targets(scratch):
    """Return all targets; samples are made in the folder ``scratch``."""
    return [*_formats(scratch), *_tables(scratch), *_documents(), *_batch(scratch)]


def _formats(scratch):
    for kind, contract in KINDS.items():
        for form, (suffix, writer) in {**writers.FORMATS[kind], **EXTRA.get(kind, {})}.items():
            path = scratch / f"sample{suffix}"
            writer(path, batches.RECORDING[kind](1).iloc[:ROWS])
            mutate = {"npz": mutations.in_archive, "X3P": mutations.in_archive, "E57": mutations.in_pages}
            yield Target(
                f"{kind}, {form}",
                f"file{suffix}",
                path.read_bytes(),
                _reader(contract, f"file{suffix}"),
                mutate.get(form, mutations.damaged),
            )
            path.unlink()


def _reader(kind, file):
    def run(folder):
        path = folder / file
        told = False
        try:
            sniff(path, kind)
        except FormatError:
            told = True
        if kind == "cloud":
            list(read_pieces(path, "cloud", 10))
        if kind == "frf":
            read_frfs(path)
        read(path, kind)
        return not told

    return run


def _pcd_compressed(path, table):
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(table.to_numpy()))
    open3d.io.write_point_cloud(str(path), cloud, compressed=True)


def _mcap_compressed(path, table):
    """Write a bag whose chunks are compressed; the writer of the samples has no such setting."""
    from rosbags.rosbag2 import enums, storage_mcap

    plain = storage_mcap.McapWriter.__init__
    storage_mcap.McapWriter.__init__ = lambda self, where, _: plain(
        self, where, enums.CompressionMode.STORAGE
    )
    try:
        writers.rosbag(path, table)
    finally:
        storage_mcap.McapWriter.__init__ = plain


EXTRA = {
    "scan": {"PCD compressed": (".pcd", _pcd_compressed)},
    "robot_log": {"MCAP zstd": (".mcap", _mcap_compressed)},
}


def _tables(scratch):
    import pandas as pd

    for kind in ("dynamometer", "hammer record"):
        batches.write(scratch / kind, kind)
    texts = {**TABLES, "runs": (scratch / "dynamometer/runs.csv").read_text()}
    texts["impacts"] = (scratch / "hammer record/impacts.csv").read_text()
    for name, text in texts.items():
        for suffix in (".csv", ".parquet"):
            path = scratch / f"{name}.csv"
            path.write_text(text)
            if suffix == ".parquet":
                pd.read_csv(path).to_parquet(scratch / f"{name}.parquet")
            yield Target(
                f"{name}{suffix}", f"{name}{suffix}", (scratch / f"{name}{suffix}").read_bytes(), _table(name)
            )


def _table(name):
    return lambda folder: not errors(read_table(folder, name)[1])


def _documents():
    config = (ROOT / "config/config.yaml").read_bytes()
    for name, text in (
        ("batch", batches.MANIFEST.encode()),
        ("cell", batches.CELL.encode()),
        ("config", config),
    ):
        yield Target(f"{name}.yaml", f"{name}.yaml", text, _document(name))
    yield Target("discovery", "specimen/batch.yaml", batches.MANIFEST.encode(), _discovered)


def _document(name):
    def run(folder):
        content, findings = read_yaml(folder / f"{name}.yaml", f"{name}.yaml")
        if not findings:
            findings = schema_findings(content, name, f"{name}.yaml", lambda _path, _near: "error")
        if name == "batch":
            read_manifest(folder)
        return not errors(findings)

    return run


def _discovered(folder):
    return bool(discover([folder], folder))


def _batch(scratch):
    folder = scratch / "whole" / "specimen"
    batches.write(folder, "dynamometer")
    kept = {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    for file in ("runs.csv", "batch.yaml"):
        yield Target(
            f"whole batch by its {file}",
            f"specimen/{file}",
            kept[Path(file)],
            partial(_checked, kept, file),
            slow=True,
        )


def _checked(kept, victim, where):
    for name, content in kept.items():
        path = where / "specimen" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if name != Path(victim):
            path.write_bytes(content)
    return check(where / "specimen", where).ok


def prepared(target, folder):
    """Make the folder that a target's file stands in."""
    (folder / target.file).parent.mkdir(parents=True, exist_ok=True)
    return folder
