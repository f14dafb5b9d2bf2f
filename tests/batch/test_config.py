from pathlib import Path

import pytest

from metro.batch.config import load_config
from metro.batch.findings import ConfigError

CONFIG = Path(__file__).parents[2] / "config/config.yaml"


def fault(path, overrides=None):
    with pytest.raises(ConfigError) as caught:
        load_config(path, overrides)
    return str(caught.value)


def test_the_configuration_of_the_repository_is_valid():
    config = load_config(CONFIG)
    assert config["raw_roots"] == ["data/raw"]
    assert config["loop"]["model_form_budget"] == 0.007


def test_an_override_replaces_its_section_whole():
    assert load_config(CONFIG, {"raw_roots": ["elsewhere"]})["raw_roots"] == ["elsewhere"]
    assert load_config(CONFIG, {"holdout": {"share": 0.5, "seed": 7}})["holdout"] == {"share": 0.5, "seed": 7}


def test_a_section_that_an_override_leaves_incomplete_is_an_error():
    assert "holdout.seed: is missing, expected an integer, 0 to 4294967295" in fault(
        CONFIG, {"holdout": {"share": 0.5}}
    )


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"raw_rots": []}, 'raw_rots: is not a known key (did you mean "raw_roots"?)'),
        ({"raw_roots": "data"}, 'raw_roots: found "data", expected a list of texts'),
        ({"raw_roots": []}, "raw_roots: found [], expected"),
        ({"holdout": {"share": 1.5, "seed": 1}}, "holdout.share: found 1.5, expected a number > 0 and < 1"),
        ({"holdout": {"share": 0.3, "sed": 1}}, 'holdout.sed: is not a known key (did you mean "seed"?)'),
        ({"cells": 3}, "cells: found 3, expected text"),
    ],
)
def test_what_is_wrong_is_said_with_the_key(overrides, message):
    assert message in fault(CONFIG, overrides)


def test_a_fault_of_the_syntax_is_said_with_file_and_line(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("cells: a\nraw_roots: [b\nloop: {}\n")
    assert str(path) in fault(path)
    assert "line 3" in fault(path)


def test_a_configuration_that_is_not_there_is_named(tmp_path):
    assert "absent.yaml: is not there" in fault(tmp_path / "absent.yaml")
