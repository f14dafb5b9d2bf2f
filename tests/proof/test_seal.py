"""The seal: what was sealed cannot be changed, nor guessed."""

import hashlib
import json

import pytest

from proof.seal import BrokenSealError, close, unseal

TRUTH = {"batches": {"blind-1": {"effects": {"tool_runout": {"radius_um": 8.9}}}}}


def test_the_truth_comes_back_and_the_seal_is_the_hash_of_its_file(tmp_path):
    digest = close(TRUTH, tmp_path / "sealed/truth.json", tmp_path / "seal.txt")
    assert digest == hashlib.sha256((tmp_path / "sealed/truth.json").read_bytes()).hexdigest()
    assert unseal(tmp_path / "sealed/truth.json", tmp_path / "seal.txt")["batches"] == TRUTH["batches"]


def test_a_changed_truth_is_refused(tmp_path):
    file = tmp_path / "sealed/truth.json"
    close(TRUTH, file, tmp_path / "seal.txt")
    file.write_text(file.read_text().replace("8.9", "9.0"))
    with pytest.raises(BrokenSealError, match=r"truth\.json"):
        unseal(file, tmp_path / "seal.txt")


def test_the_same_truth_has_another_seal_each_time(tmp_path):
    digests = {close(TRUTH, tmp_path / f"{i}/truth.json", tmp_path / "seal.txt") for i in range(3)}
    assert len(digests) == 3
    assert len(json.loads((tmp_path / "0/truth.json").read_text())["salt"]) == 64
