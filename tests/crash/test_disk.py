"""A disk that is full or read-only: an error in words, nothing half-written, and the next call completes."""

import os
import shutil
import subprocess

import pytest
from outputs import leftovers, outputs, torn
from stage_runs import STAGES, refused_beyond, run


@pytest.fixture
def small_disk(tmp_path):
    """Return a disk of a few megabytes; skip the test where mounting one is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", place]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("mounting a disk is not allowed here")
    yield place
    subprocess.run(["umount", place], check=True)


def completes(undisturbed, stage, folder):
    assert torn(folder, undisturbed.after[stage]) == []
    assert leftovers(folder) == []
    assert run(stage, folder) == (0, "")
    assert outputs(folder) == undisturbed.after[stage]


@pytest.mark.parametrize(("stage", "size"), [("ingest", 700), ("loop", 500), ("campaign", 20_000)])
def test_a_file_larger_than_allowed_is_told_and_not_left(undisturbed, stage, size, tmp_path):
    folder = tmp_path / "work"
    shutil.copytree(undisturbed.before[stage], folder)
    code, said = refused_beyond(stage, folder, size)
    assert code == 2
    assert "cannot be written: File too large; larger than" in said
    completes(undisturbed, stage, folder)


@pytest.mark.parametrize("stage", STAGES)
def test_a_full_disk_is_told_and_room_is_all_that_it_needs(undisturbed, stage, small_disk):
    folder = small_disk / "work"
    shutil.copytree(undisturbed.before[stage], folder)
    filler = small_disk / "filler"
    free = os.statvfs(small_disk).f_bavail * os.statvfs(small_disk).f_frsize
    filler.write_bytes(bytes(free))
    code, said = run(stage, folder)
    assert code == 2
    assert "cannot be written: No space left on device; make room" in said
    assert str(folder) in said
    filler.unlink()
    completes(undisturbed, stage, folder)


@pytest.mark.parametrize("stage", ["ingest", "loop", "report"])
def test_a_read_only_folder_is_told(undisturbed, stage, small_disk):
    folder = small_disk / "work"
    shutil.copytree(undisturbed.before[stage], folder)
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    code, said = run(stage, folder)
    assert code == 2
    assert "cannot be written: Read-only file system; make the folder writable" in said
    subprocess.run(["mount", "-o", "remount,rw", small_disk], check=True)
    completes(undisturbed, stage, folder)


def test_something_in_the_way_is_told(undisturbed, tmp_path):
    folder = tmp_path / "work"
    shutil.copytree(undisturbed.before["ingest"], folder)
    (folder / "data/processed").write_text("")
    code, said = run("ingest", folder)
    assert code == 2
    assert "something else has its name" in said
    (folder / "data/processed").unlink()
    completes(undisturbed, "ingest", folder)
