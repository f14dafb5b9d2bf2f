"""A small checkout in a temporary folder, in which snakemake is called for real."""

import shutil

import pytest
from checkout import Checkout
from program_copy import copy_program


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Return a checkout with two batches whose reports are up to date."""
    folder = tmp_path_factory.mktemp("finished")
    copy_program(folder)
    checkout = Checkout(folder)
    checkout.add_batch("alpha")
    checkout.add_batch("beta")
    checkout.first_output = checkout.call()
    return checkout


@pytest.fixture
def checkout(finished, tmp_path):
    """Return a copy of the finished checkout, to be changed by the test."""
    shutil.copytree(finished.folder, tmp_path / "checkout", symlinks=True)
    return Checkout(tmp_path / "checkout")
