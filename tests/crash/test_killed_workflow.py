"""The workflow killed at random moments: the exhaustive form of tests/workflow/test_crashes.py."""

import pytest
from kills import kills

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_fifty_kills_at_random_moments(tmp_path):
    done = list(kills(tmp_path, [], 50, seed=9))
    assert [one for one in done if not one.survived] == []
    assert len({one.hit for one in done}) >= 5
