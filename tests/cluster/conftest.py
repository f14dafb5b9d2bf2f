"""A checkout of two small batches, and what a local run makes of it."""

import shutil

import pytest
from checkout import Checkout
from outputs import outputs
from program_copy import copy_program

BATCHES = ("alpha", "beta")


@pytest.fixture(scope="session")
def unrun(tmp_path_factory):
    """Return a checkout with two batches and no outputs."""
    checkout = Checkout(tmp_path_factory.mktemp("unrun"))
    copy_program(checkout.folder)
    for name in BATCHES:
        checkout.add_batch(name)
    return checkout


@pytest.fixture(scope="session")
def reference(unrun, tmp_path_factory):
    """Return SHA-256 by path of what a local run writes."""
    local = tmp_path_factory.mktemp("local") / "checkout"
    shutil.copytree(unrun.folder, local)
    Checkout(local).call()
    return outputs(local)
