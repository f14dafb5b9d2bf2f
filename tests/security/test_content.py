"""No file of a batch runs code, and none unpacks beyond the limits."""

import io
import struct
import zipfile
from pathlib import Path

import corpus_batches as batches
import corpus_writers as writers
import fuzz_mutations
import numpy as np
import pandas as pd
import pytest

from metro.batch.discover import discover
from metro.batch.documents import read_yaml
from metro.batch.tables import read_table
from metro.formats import FormatError
from metro.formats.registry import read


class Trap:
    """What a pickle of it does when it is loaded: write a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.write_text, (self.path, "sprung")


@pytest.fixture
def trap(tmp_path):
    trap = Trap(tmp_path / "sprung")
    yield trap
    assert not trap.path.exists()


def refused(path, kind):
    with pytest.raises(FormatError) as caught:
        read(path, kind)
    return caught.value.message


def sample(tmp_path, kind, form):
    suffix, writer = writers.FORMATS[kind][form]
    path = tmp_path / f"sample{suffix}"
    writer(path, batches.RECORDING[kind](1).iloc[:40])
    return path


@pytest.mark.parametrize(
    "text",
    [
        "a: !!python/object/apply:pathlib.Path.write_text [{path}, sprung]",
        "a: !!python/object/new:os.system ['touch {path}']",
        "a: !!set {{b}}",
        "a: !!binary aGVsbG8=",
        "a: !!float abc",
        "a: !!bool abc",
        f"a: {'9' * 5000}",
    ],
)
def test_yaml_has_no_tags_but_plain_ones(tmp_path, trap, text):
    path = tmp_path / "batch.yaml"
    path.write_text(text.format(path=trap.path))
    content, findings = read_yaml(path, "batch.yaml")
    assert (content, len(findings)) == ({}, 1)
    assert findings[0].row == 1


def bomb(levels=40):
    rows = ["a0: &a0 {k: v}"]
    rows += [f"a{i}: &a{i} {{<<: [*a{i - 1}, *a{i - 1}, *a{i - 1}]}}" for i in range(1, levels)]
    return "\n".join(rows) + "\n"


def test_yaml_does_not_unfold(tmp_path):
    folder = tmp_path / "specimen"
    folder.mkdir()
    (folder / "batch.yaml").write_text(bomb())
    assert "alias" in str(read_yaml(folder / "batch.yaml", "batch.yaml")[1])
    assert [found.name for found in discover([tmp_path], tmp_path)] == ["specimen"]


def test_a_description_of_megabytes_is_not_parsed(tmp_path):
    path = tmp_path / "batch.yaml"
    path.write_text("# x\n" * (1 << 19))
    assert "expected at most" in str(read_yaml(path, "batch.yaml")[1])


def test_arrays_of_objects_are_not_unpickled(tmp_path, trap):
    path = tmp_path / "frf.npz"
    np.savez(path, freq_hz=np.array([trap] * 9, dtype=object), frf=np.arange(9.0))
    assert "not a readable NumPy archive" in refused(path, "frf")


def test_parquet_columns_of_objects_are_not_unpickled(tmp_path, trap):
    import pickle

    import pyarrow as pa
    import pyarrow.parquet as pq

    extension = {
        b"ARROW:extension:name": b"arrow.py_extension_type",
        b"ARROW:extension:metadata": pickle.dumps(trap),
    }
    values = pa.array([pickle.dumps(trap)] * 9, pa.binary())
    table = pa.table([values], schema=pa.schema([pa.field("x_mm", pa.binary(), metadata=extension)]))
    pq.write_table(table.append_column("z_mm", pa.array(np.arange(9.0))), tmp_path / "profile.parquet")
    assert "expected numbers" in refused(tmp_path / "profile.parquet", "profile")
    pq.write_table(table.rename_columns(["run"]), tmp_path / "runs.parquet")
    read_table(tmp_path, "runs")


@pytest.mark.parametrize("form", ["RSI", "X3P", "E57"])
def test_xml_entities_are_not_unfolded(tmp_path, form):
    dtd = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b SYSTEM "file:///etc/passwd">]>'
    if form == "RSI":
        path = sample(tmp_path, "robot_log", form)
        text = path.read_text().replace('D="0"', 'D="&b;"')
        path.write_bytes(b"<Rob>" + dtd + b"</Rob>" + text.encode())
        assert "no whole telegram" in refused(path, "robot")
    elif form == "X3P":
        path = sample(tmp_path, "profile", form)
        repacked(path, "main.xml", lambda xml: xml.replace(b"?>", b"?>" + dtd, 1))
        assert "not a readable X3P" in refused(path, "profile")
    else:
        path = sample(tmp_path, "scan", form)
        with_xml(path, lambda xml: xml.replace(b"?>", b"?>" + dtd, 1))
        assert "declares a document type" in refused(path, "cloud")


def repacked(path, member, change):
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members[member] = change(members[member])
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def with_xml(path, change):
    """Change the XML of an E57 file, with lengths and checksums that fit."""
    data = path.read_bytes()
    head = struct.Struct("<8s2L4Q")
    mark, major, minor, _, start, size, page = head.unpack(data[: head.size])
    content = b"".join(data[at : at + 1020] for at in range(0, len(data), 1024))
    at = start // 1024 * 1020 + start % 1024
    xml = change(content[at : at + size])
    content = content[:at] + xml
    content += b"\0" * (-len(content) % 1020)
    content = (
        head.pack(mark, major, minor, len(content) // 1020 * 1024, start, len(xml), page)
        + content[head.size :]
    )
    pages = (content[at : at + 1020] + bytes(4) for at in range(0, len(content), 1020))
    path.write_bytes(b"".join(map(fuzz_mutations._signed, pages)))


def test_xml_that_is_nested_deeply_is_refused(tmp_path):
    path = sample(tmp_path, "scan", "E57")
    deep = b'<x type="Structure">' * 1000 + b"</x>" * 1000
    with_xml(path, lambda xml: xml.replace(b"</e57Root>", b'<y type="Structure">' + deep + b"</y></e57Root>"))
    assert "nested" in refused(path, "cloud")


def test_an_archive_that_states_too_much_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.formats.limits.LARGEST_ARCHIVE", 1 << 23)
    path = tmp_path / "frf.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("frf.npy", "w") as member:
        for _ in range(10):
            member.write(bytes(1 << 20))
    assert path.stat().st_size < 1 << 15
    assert "unpacks to" in refused(path, "frf")


def test_an_array_that_states_more_than_its_member_holds_is_refused(tmp_path):
    path = tmp_path / "frf.npz"
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (1 << 50,)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("freq_hz.npy", head.getvalue() + bytes(80))
        archive.writestr("frf.npy", head.getvalue() + bytes(80))
    assert "not a readable NumPy archive" in refused(path, "frf")


def test_a_parquet_table_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("metro.formats.limits.LARGEST", 1 << 20)
    monkeypatch.setattr("metro.formats.limits.check_unpacked.__defaults__", (1 << 20,))
    monkeypatch.setattr("metro.batch.tables.MOST_CELLS", 1 << 16)
    pd.DataFrame({"x_mm": np.zeros(1 << 17), "z_mm": 0.0}).to_parquet(tmp_path / "profile.parquet")
    assert (tmp_path / "profile.parquet").stat().st_size < 1 << 13
    assert "unpacks to" in refused(tmp_path / "profile.parquet", "profile")
    pd.DataFrame({"run": ["r"] * (1 << 17)}).to_parquet(tmp_path / "runs.parquet")
    assert "cells" in str(read_table(tmp_path, "runs")[1])


def lzf_bomb(points):
    head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    head += f"WIDTH {points}\nHEIGHT 1\n"
    return f"{head}VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary_compressed\n".encode()


@pytest.mark.parametrize("sizes", [(8, 12), (8, 12_000_000), (1 << 31, 12_000_000)])
def test_a_compressed_pcd_does_not_read_or_unpack_beyond_its_end(tmp_path, sizes):
    path = tmp_path / "scan.pcd"
    path.write_bytes(lzf_bomb(1_000_000) + struct.pack("<2I", *sizes) + bytes(8))
    assert "damaged" in refused(path, "cloud")


def test_a_pcd_header_does_not_make_a_million_columns(tmp_path):
    path = tmp_path / "scan.pcd"
    path.write_bytes(lzf_bomb(1).replace(b"COUNT 1 1 1", b"COUNT 1 1 1000000000"))
    assert "disagree" in refused(path, "cloud")


def test_chunks_of_a_bag_unpack_within_limits(tmp_path, monkeypatch):
    from rosbags.rosbag2 import storage_mcap

    from metro.formats import bag_limits

    packed = storage_mcap.zstd.compress(bytes(1 << 22))
    with bag_limits.limited_chunks(tmp_path, most=1 << 20):
        unpack = storage_mcap.DECOMPRESSORS["zstd"]
        assert len(unpack(packed, 1000)) == 1001  # its size is a lie: one byte more, for the reader to refuse
        with pytest.raises(FormatError, match="unpacks to more"):
            unpack(packed, 1 << 22)
        for _ in range(1047):  # the same chunk, named again and again
            unpack(packed, 1000)
        with pytest.raises(FormatError, match="unpacks to more"):
            unpack(packed, 1000)
    assert storage_mcap.DECOMPRESSORS["zstd"](packed, 0) == bytes(1 << 22)


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE VIEW v AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x FROM c",
        "ALTER TABLE messages ADD COLUMN more BLOB GENERATED ALWAYS AS (zeroblob(1000000000))",
        "CREATE TRIGGER t AFTER INSERT ON messages BEGIN SELECT 1; END",
    ],
)
def test_a_bag_of_sqlite_computes_nothing(tmp_path, statement):
    import sqlite3

    path = sample(tmp_path, "robot_log", "ROS db3")
    database = sqlite3.connect(path)
    database.execute(statement)
    database.commit()
    database.close()
    assert "computes" in refused(path, "robot")


def test_a_name_that_sqlite_would_take_for_another_path_is_refused(tmp_path):
    path = sample(tmp_path, "robot_log", "ROS db3")
    inner = tmp_path / "batch"
    inner.mkdir()
    (inner / "%2e%2e%2fsample.db3").write_bytes(path.read_bytes())
    assert "in its name" in refused(inner / "%2e%2e%2fsample.db3", "robot")


@pytest.mark.parametrize("name", ["x: int = __import__('os').system('true')", "__class__", "X"])
def test_message_definitions_make_no_code_but_of_names(tmp_path, name):
    from rosbags.interfaces import Nodetype

    from metro.formats.bag_limits import plain_types

    kind = "control_msgs/msg/JointTrajectoryControllerState"
    field = (Nodetype.BASE, ("float64", 0))
    with pytest.raises(FormatError, match="found the name"):
        plain_types(tmp_path, {kind: ([], [(name, field)])})
    with pytest.raises(FormatError, match="found the name"):
        plain_types(tmp_path, {f"control_msgs/msg/{name}:\n pass": ([], [("x", field)])})
    assert plain_types(tmp_path, {kind: ([("C", "int32", 1)], [("x", field)])}) == {
        kind: ([], [("x", field)])
    }
