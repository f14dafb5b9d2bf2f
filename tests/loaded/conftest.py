import pytest
from closed_project import ROOT, closed_project

import metro


@pytest.fixture(scope="session")
def project(tmp_path_factory):
    """Return a folder in which the bundled batch clean-slot has a verdict; not to be changed."""
    return closed_project(tmp_path_factory.mktemp("project"), ROOT / "data/raw/clean-slot")


@pytest.fixture(scope="session")
def loaded(project):
    return metro.load("clean-slot", project)
