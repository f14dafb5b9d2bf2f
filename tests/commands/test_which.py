"""A batch is meant by its name, or by its folder among raw files, tables or results."""

import pytest

from metro.batch.findings import ContractError
from metro.commands.calls import CallError
from metro.commands.which import batch_name, processed_folder, raw_folder, raw_roots, reports_folder

FORMS = ["late", "late/", "data/raw/late", "data/processed/late/", "reports/late", "./reports/late"]


@pytest.mark.parametrize("given", FORMS)
def test_every_form_is_taken_everywhere(own_campaign, given):
    assert raw_folder(given).resolve() == own_campaign / "data/raw/late"
    assert processed_folder(given).resolve() == own_campaign / "data/processed/late"
    assert reports_folder(given).resolve() == own_campaign / "reports/late"
    assert batch_name(given, own_campaign / "data/processed", own_campaign / "reports") == "late"


def test_a_folder_elsewhere_is_taken_for_itself_and_for_no_batch_of_its_name_here(own_campaign, tmp_path):
    other = tmp_path / "other"
    (own_campaign / "data/raw/late").rename(other)
    assert raw_folder(str(other)) == other
    elsewhere = tmp_path / "lab/late"
    elsewhere.mkdir(parents=True)
    with pytest.raises(CallError, match="is in no folder of batches here"):
        batch_name(str(elsewhere), own_campaign / "data/processed", own_campaign / "reports")
    with pytest.raises(CallError, match="is in no folder of batches here"):
        reports_folder(str(elsewhere))


def test_a_linked_folder_has_the_name_of_the_link(own_campaign, tmp_path):
    (own_campaign / "data/raw/late").rename(tmp_path / "measured-in-may")
    (own_campaign / "data/raw/late").symlink_to(tmp_path / "measured-in-may")
    assert reports_folder("data/raw/late").name == "late"


def test_raw_batches_are_in_the_folders_that_the_settings_name(own_campaign):
    assert [str(root) for root in raw_roots()] == ["data/raw"]
    (own_campaign / "config").mkdir()
    (own_campaign / "config/config.yaml").write_text("raw_roots: [data/raw, lab]\n")
    (own_campaign / "lab").mkdir()
    (own_campaign / "data/raw/late").rename(own_campaign / "lab/late")
    assert str(raw_folder("late")) == "lab/late"
    (own_campaign / "config/config.yaml").write_text("raw_roots: [data/raw")
    assert [str(root) for root in raw_roots()] == ["data/raw"]


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("lat", 'lat: there is no such batch (did you mean "late"?)'),
        ("data/raw/lat", 'data/raw/lat: there is no such batch (did you mean "late"?)'),
        ("nope", "nope: there is no such batch; there are: early, late"),
        ("data/raw", "data/raw: is a folder of batches (did you mean data/raw/*?)"),
        (
            "data/raw/late/batch.yaml",
            'is a file, expected the folder of a batch (did you mean "data/raw/late"?)',
        ),
        ("data/raw/late/force/r1.csv", "r1.csv: is a file, expected the folder of a batch"),
        (
            "data/raw/late/force",
            "holds no batch.yaml: not the folder of a batch; metro import FILES makes one of a lab's files",
        ),
    ],
)
def test_what_names_no_raw_batch_is_told_with_what_was_meant(own_campaign, given, told):
    with pytest.raises(CallError) as caught:
        raw_folder(given)
    assert str(caught.value).endswith(told)


def test_a_batch_that_was_not_computed_is_an_error_of_the_input_not_of_the_call(own_campaign):
    (own_campaign / "data/raw/new").mkdir()
    (own_campaign / "data/raw/new/batch.yaml").write_text("format: 1\n")
    folders = own_campaign / "data/processed", own_campaign / "reports"
    asked = (
        lambda: batch_name("new", *folders),
        lambda: reports_folder("new"),
        lambda: processed_folder("new"),
    )
    for ask in asked:
        with pytest.raises(ContractError, match="call metro run") as caught:
            ask()
        assert not isinstance(caught.value, CallError)
    with pytest.raises(ContractError, match="holds no batch yet: call metro run") as caught:
        batch_name("late", own_campaign / "nothing", own_campaign / "reports")
    assert not isinstance(caught.value, CallError)
