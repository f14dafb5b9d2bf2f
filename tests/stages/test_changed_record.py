"""A record that is read twice and changed in between: told in words, and nothing is written."""

import shutil
from pathlib import Path

import pytest

from metro.batch.findings import BatchError
from metro.stages import recordings
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]


def test_a_record_that_is_changed_between_two_readings_is_an_error_that_names_it(tmp_path, monkeypatch):
    batch = tmp_path / "clean-slot"
    shutil.copytree(ROOT / "data" / "raw" / "clean-slot", batch)
    judged = recordings._fit_force

    def changed(*given):
        fit = judged(*given)
        (batch / given[3]).write_bytes(b"overwritten by the next recording")
        return fit

    monkeypatch.setattr(recordings, "PIECE", 1000)
    monkeypatch.setattr(recordings, "_fit_force", changed)
    with pytest.raises(BatchError) as error:
        ingest(batch, ROOT / "config" / "cells", tmp_path / "out", {}, "test")
    assert "force/" in str(error.value)
    assert not (tmp_path / "out").exists()
