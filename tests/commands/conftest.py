import pytest
from small_campaign import write_campaign


@pytest.fixture(scope="session")
def campaign(tmp_path_factory):
    """Return a folder with two finished batches; not to be changed."""
    return write_campaign(tmp_path_factory.mktemp("campaign"))


@pytest.fixture
def own_campaign(tmp_path, monkeypatch):
    """Return such a folder for the test's own use, as the working folder."""
    monkeypatch.chdir(tmp_path)
    return write_campaign(tmp_path)
