"""A new batch is there whole or not at all; what a killed command leaves is hidden, and in nobody's way."""

import itertools
import signal

import pytest
from stage_runs import killed_at_event, refused_beyond, run

from metro.batch.discover import discover
from metro.batch.whole_folder import whole_folder

FILES = ["README.md", "batch.yaml", "runs.csv"]


def visible(folder):
    return sorted(path.name for path in (folder / "data/raw").glob("[!.]*/*"))


def test_killed_at_every_change_to_a_file(tmp_path):
    for number in itertools.count(1):
        folder = tmp_path / str(number)
        (folder / "data/raw").mkdir(parents=True)
        code, said = killed_at_event("new-batch", folder, number)
        assert code in (0, -signal.SIGKILL), said
        if code == 0:
            break
        assert visible(folder) in ([], FILES)
        assert [batch.name for batch in discover([folder / "data/raw"], folder)] in ([], ["my-cut"])
        if not visible(folder):
            assert run("new-batch", folder) == (0, "")
        assert visible(folder) == FILES
    assert number > 6


def test_a_file_larger_than_allowed_is_told_and_nothing_is_left(tmp_path):
    code, said = refused_beyond("new-batch", tmp_path, 500)
    assert code == 2
    assert "my-cut: cannot be written: File too large" in said
    assert list((tmp_path / "data/raw").iterdir()) == []


def test_the_folder_has_the_rights_of_any_other_and_an_error_leaves_nothing(tmp_path):
    (tmp_path / "any").mkdir()
    with whole_folder(tmp_path / "a") as filled:
        (filled / "file").write_text("")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "any").stat().st_mode
    with pytest.raises(KeyError), whole_folder(tmp_path / "b"):
        raise KeyError
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "any"]
