"""Tests that share a fixture run in one worker of pytest-xdist, so that what they share is made once.

Without this every worker makes it for itself: xdist hands out tests one by one, whatever they have in common.
"""

import os

import pytest

# Compiled once instead of by every process that a test starts.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

SHARED = ("module", "package", "session")


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in the same hook
def pytest_collection_modifyitems(items):
    for item in items:
        group = shared_by(item)
        if group and not item.get_closest_marker("xdist_group"):
            item.add_marker(pytest.mark.xdist_group(group))


def shared_by(item):
    """Return the widest place whose fixture, made once for all tests there, a test uses; "" for none."""
    definitions = item._fixtureinfo.name2fixturedefs.values()
    places = [one.baseid for each in definitions for one in each if one.scope in SHARED]
    return min((place for place in places if place.startswith("tests/")), key=len, default="")
