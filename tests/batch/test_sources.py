"""Mappings of batch.yaml: checked with their key, and followed by check and ingest alike."""

import numpy as np
import pandas as pd
import pytest
from conftest import edit

from metro.batch.check import HOLDOUT, check
from metro.batch.findings import BatchError
from metro.stages.ingest import ingest

MAPPING = """
files:
  "dyno/*.txt":
    rate_hz: 1000
    columns:
      fx_n: {from: "X{record}", unit: kN}
      fy_n: {from: "Y{record}", unit: N, scale: -1}
      fz_n: {from: "Z{record}", unit: V, sensitivity: 500 N/V}
"""


@pytest.fixture
def mapped(batch):
    """The batch with its four records in one file of another program, and its copy in the contract's form."""
    (batch / "batch.yaml").write_text((batch / "batch.yaml").read_text() + MAPPING)
    theirs = {}
    for k in range(1, 5):
        forces = np.random.default_rng(k).normal(size=(3, 400)).round(6)
        own = dict(zip(("fx_n", "fy_n", "fz_n"), forces * 100, strict=True))
        pd.DataFrame({"t_s": np.arange(400) / 1000, **own}).to_csv(batch / f"dyno/r{k}.csv", index=False)
        theirs |= {f"X{k}": own["fx_n"] / 1e3, f"Y{k}": -own["fy_n"], f"Z{k}": own["fz_n"] / 500}
        if k > 1:
            edit(batch / "runs.csv", f"dyno/r{k}.csv", f"dyno/all.txt#{k}")
    pd.DataFrame(theirs).to_csv(batch / "dyno/all.txt", sep=";", decimal=",", index=False)
    return batch


def test_a_mapped_record_is_ingested_as_the_contract_s_own_form(mapped, tmp_path):
    assert check(mapped).ok
    ingest(mapped, tmp_path, tmp_path / "mapped", {"holdout": HOLDOUT}, "")
    for k in range(2, 5):
        edit(mapped / "runs.csv", f"dyno/all.txt#{k}", f"dyno/r{k}.csv")
    ingest(mapped, tmp_path, tmp_path / "own", {"holdout": HOLDOUT}, "")
    tables = [pd.read_parquet(tmp_path / name / "force.parquet") for name in ("mapped", "own")]
    pd.testing.assert_frame_equal(*tables, rtol=1e-12)
    assert len(tables[0]) == 4 * 400


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("fx_n:", "fx:", 'fx: is no column of the contract (did you mean "fx_n"?)'),
        ("unit: kN", "unit: kg", "columns.fx_n: found the unit 'kg'"),
        ("unit: kN", "unit: mm", "columns.fx_n: found the unit mm, expected one of N"),
        ("500 N/V", "500 N", 'columns.fz_n: found "500 N", expected a number and two units'),
        ("scale: -1", "scale: 0", "scale: found 0"),
        ("rate_hz: 1000\n    ", "rate: 1000\n    ", 'rate: is not a known key (did you mean "rate_hz"?)'),
        (
            "columns:",
            "columns:\n      t_s: {from: 1, unit: s}",
            "rate_hz: makes t_s, which columns names too",
        ),
        ("X{record}", "U{record}", 'columns.fx_n: found no "U2" in all.txt'),
    ],
)
def test_a_wrong_mapping_is_an_error_with_its_key(mapped, old, new, says):
    edit(mapped / "batch.yaml", old, new)
    text = "\n".join(map(str, check(mapped).problems))
    assert says in text
    assert not check(mapped).ok


def test_a_record_may_not_be_taken_from_outside_the_batch(mapped):
    edit(mapped / "batch.yaml", 'from: "X{record}"', 'file: "../../X{record}.txt", from: 1')
    assert "outside" in "\n".join(map(str, check(mapped).problems))


def test_two_records_of_one_file_are_no_copies_but_one_named_twice_is_seen(mapped, tmp_path):
    (mapped / "dyno/copy.txt").write_bytes((mapped / "dyno/all.txt").read_bytes())
    edit(mapped / "runs.csv", "dyno/all.txt#3", "dyno/copy.txt#2")
    with pytest.raises(BatchError, match=r"same content as dyno/all.txt#2"):
        ingest(mapped, tmp_path, tmp_path / "mapped", {"holdout": HOLDOUT}, "")
