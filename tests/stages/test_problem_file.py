"""The file of a batch's problems: what is written is read back, and nothing else can be read from it."""

import os
import pickle

import numpy as np
import pytest

from metro.codehash import hash_of, imported_modules
from metro.observables.problem import Refusal
from metro.stages import problem_file
from metro.stages.problem_file import FILE, Posed, read_problems, write_problems


def test_problems_are_read_as_they_were_written(tmp_path):
    write_problems(tmp_path, {"force": Posed(Refusal("no dynamometer file")), "lobes": Posed(Refusal(""))})
    posed = read_problems(tmp_path)
    assert list(posed) == ["force", "lobes"]
    assert posed["force"].task.reason == "no dynamometer file"
    assert posed["force"].base is None
    assert not posed["force"].printed


class Call:
    """Pickled as a call of a function."""

    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


@pytest.mark.parametrize(
    "harmful", [Call(os.system, "true"), Call(eval, "1"), Call(np.load, "a"), Call(np.fromfile, "a")]
)
def test_a_file_that_would_run_code_is_refused(tmp_path, harmful):
    (tmp_path / FILE).write_bytes(pickle.dumps({"force": harmful}))
    with pytest.raises(pickle.UnpicklingError, match="which no problem is made of"):
        read_problems(tmp_path)


def test_the_file_holds_the_hash_of_the_code_that_it_names(tmp_path, monkeypatch):
    write_problems(tmp_path, {"force": Posed(Refusal("no dynamometer file"))})
    modules = set(imported_modules("metro.stages.problem_file", "metro.observables.problem"))
    assert (tmp_path / FILE).read_bytes().endswith(hash_of(*modules).encode())
    before = (tmp_path / FILE).read_bytes()
    write_problems(tmp_path, {"force": Posed(Refusal("no dynamometer file"))})
    assert (tmp_path / FILE).read_bytes() == before
    monkeypatch.setattr(problem_file, "hash_of", lambda *_: "0" * 64)  # as after an edit
    write_problems(tmp_path, {"force": Posed(Refusal("no dynamometer file"))})
    assert (tmp_path / FILE).read_bytes() != before
    assert read_problems(tmp_path)["force"].task.reason == "no dynamometer file"
