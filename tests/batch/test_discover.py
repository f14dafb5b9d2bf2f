import subprocess
import sys

import pytest

from metro.batch.discover import discover
from metro.batch.findings import BatchError


def make(root, name, cell="kr160"):
    folder = root / name
    (folder / "deep").mkdir(parents=True)
    (folder / "batch.yaml").write_text(f"cell: {cell}\n")
    (folder / "deep/b.csv").write_text("x")
    (folder / "a.csv").write_text("x")
    return folder


def test_batches_of_all_roots_are_found_by_name(tmp_path):
    make(tmp_path / "one", "b-2")
    make(tmp_path / "two", "a1")
    (tmp_path / "one/notes").mkdir()
    assert [found.name for found in discover([tmp_path / "one", tmp_path / "two"])] == ["a1", "b-2"]


def test_every_file_of_a_batch_is_listed_but_dotfiles(tmp_path):
    folder = make(tmp_path, "b")
    (folder / ".DS_Store").write_text("x")
    (folder / ".cache").mkdir()
    (folder / ".cache/c.csv").write_text("x")
    (folder / "gone.csv").symlink_to(folder / "nowhere.csv")
    (found,) = discover([tmp_path])
    assert found.files == tuple(folder / name for name in ("a.csv", "batch.yaml", "deep/b.csv"))


def test_the_shared_cell_and_its_stations_are_inputs_of_a_batch_without_a_cell(tmp_path):
    make(tmp_path / "raw", "b")
    cells = tmp_path / "cells"
    cells.mkdir()
    (cells / "kr160.yaml").write_text("cell: kr160\nstations: kr160.csv\n")
    (cells / "kr160.csv").write_text("x")
    (found,) = discover([tmp_path / "raw"], cells)
    assert found.inputs[-2:] == (cells / "kr160.yaml", cells / "kr160.csv")


@pytest.mark.parametrize("cell", ["unknown", "[not text]", "{"])
def test_a_cell_that_is_not_known_or_not_readable_is_none(tmp_path, cell):
    make(tmp_path / "raw", "b", cell)
    (found,) = discover([tmp_path / "raw"], tmp_path)
    assert found.cell_file is None
    assert found.inputs == found.files


def test_a_batch_with_its_own_cell_does_not_use_the_shared_one(tmp_path):
    folder = make(tmp_path / "raw", "b")
    (folder / "cell.yaml").write_text("cell: kr160\n")
    (tmp_path / "kr160.yaml").write_text("cell: kr160\n")
    assert discover([tmp_path / "raw"], tmp_path)[0].cell_file is None


def test_one_name_under_two_roots_is_an_error_that_names_both(tmp_path):
    first, second = make(tmp_path / "one", "b"), make(tmp_path / "two", "b")
    with pytest.raises(BatchError) as caught:
        discover([tmp_path / "one", tmp_path / "two"])
    assert str(first) in str(caught.value)
    assert str(second) in str(caught.value)


def test_a_root_given_twice_is_one_root(tmp_path):
    make(tmp_path / "raw", "b")
    (tmp_path / "link").symlink_to(tmp_path / "raw")
    assert len(discover([tmp_path / "raw", tmp_path / "link"])) == 1


def test_all_faults_are_named_at_once(tmp_path):
    make(tmp_path, "Side Milling")
    make(tmp_path, "-b")
    with pytest.raises(BatchError) as caught:
        discover([tmp_path, tmp_path / "absent"])
    assert [problem.file.split("/")[-1] for problem in caught.value.problems] == [
        "-b",
        "Side Milling",
        "absent",
    ]


def test_discovery_imports_no_pandas():
    code = "import sys, metro.batch.discover; sys.exit('pandas' in sys.modules or 'numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
