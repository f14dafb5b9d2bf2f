"""A small batch that was brought to its report once, undisturbed."""

import pytest
from stage_runs import Undisturbed


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    return Undisturbed(tmp_path_factory.mktemp("undisturbed"))
