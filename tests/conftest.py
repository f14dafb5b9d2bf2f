"""Tests that share a fixture run in one worker of pytest-xdist, so that what they share is made once.

Without this every worker makes it for itself: xdist hands out tests one by one, whatever they have in common.
"""

import os

import pytest

# Compiled once instead of by every process that a test starts.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

SHARED = ("module", "package", "session")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """Put the group of a test behind its name, where the scheduler of xdist looks for it.

    xdist 3.8 means to do so itself for what is marked, but does it where pytest 9 no longer reads the name.
    """
    if not getattr(config.option, "loadgroup", False):  # xdist sets it in its workers
        return
    for item in items:
        marked = item.get_closest_marker("xdist_group")
        group = marked.args[0] if marked else shared_by(item)
        if group and not item.nodeid.endswith(f"@{group}"):
            item._id = type(item._id).parse(f"{item.nodeid}@{group}")


def shared_by(item):
    """Return the widest place whose fixture, made once for all tests there, a test uses; "" for none."""
    definitions = item._fixtureinfo.name2fixturedefs.values()
    places = [one.baseid for each in definitions for one in each if one.scope in SHARED]
    return min((place for place in places if place.startswith("tests/")), key=len, default="")
