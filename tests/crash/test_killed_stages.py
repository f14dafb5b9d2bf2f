"""A stage that is killed leaves no half of a file, and run again it gives the bytes of an undisturbed run."""

import itertools
import shutil
import signal

import pytest
from outputs import leftovers, outputs, torn
from stage_runs import PROCESSED, STAGES, Undisturbed, killed_at_event, killed_within_write, run

from metro.batch.at_work import remove_leftovers

# Every so many changes to files a kill, in the ordinary tests; the exhaustive ones kill at each of them.
STEP = {"ingest": 14, "identify": 53, "predict": 2, "loop": 5, "verdict": 5, "report": 5, "campaign": 5}


def survives(undisturbed, stage, folder, kill):
    """Kill a stage in a copy of the folder, look at what is left, run it again; False if it ran through."""
    shutil.copytree(undisturbed.before[stage], folder)
    code, said = kill(folder)
    assert code in (0, -signal.SIGKILL, -signal.SIGXFSZ), said
    assert torn(folder, undisturbed.after[stage]) == []
    if code == 0:
        assert outputs(folder) == undisturbed.after[stage]
        return False
    remove_leftovers(folder / "data/processed", folder / "reports")
    assert leftovers(folder) == []
    assert run(stage, folder)[0] == 0
    assert outputs(folder) == undisturbed.after[stage]
    shutil.rmtree(folder)
    return True


def kills_survived(undisturbed, stage, folder, step):
    """Kill a stage at every ``step``-th change to a file, until it is through; return the number of kills."""
    points = itertools.count(1, step)
    return sum(
        1
        for _ in itertools.takewhile(
            lambda at: survives(
                undisturbed, stage, folder / str(at), lambda work: killed_at_event(stage, work, at)
            ),
            points,
        )
    )


@pytest.mark.parametrize("stage", ["ingest", "loop", "report", "verdict"])
def test_a_stage_killed_between_two_changes_to_files(undisturbed, stage, tmp_path):
    assert kills_survived(undisturbed, stage, tmp_path, STEP[stage]) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_killed_at_every_change_to_a_file(undisturbed, stage, tmp_path):
    number = kills_survived(undisturbed, stage, tmp_path, 1)
    print(f"{stage}: {number} kills survived")
    assert number >= 4


@pytest.mark.parametrize(("stage", "size"), [("ingest", 700), ("loop", 500), ("report", 20_000)])
def test_a_stage_killed_in_the_middle_of_a_file(undisturbed, stage, size, tmp_path):
    def kill(folder):
        return killed_within_write(stage, folder, size)

    assert survives(undisturbed, stage, tmp_path / "work", kill)


@pytest.mark.parametrize("step", [9, pytest.param(1, marks=pytest.mark.slow)])
def test_what_describes_a_batch_is_never_beside_tables_of_another_ingest(undisturbed, step, tmp_path):
    was = Undisturbed(tmp_path / "was", value=90.0, title="As it was")
    old, new = was.after["ingest"], undisturbed.after["ingest"]
    changed = {name for name in new if old[name] != new[name]}
    assert len(changed) >= 3
    assert str(PROCESSED / "batch.json") in changed
    for number in range(1, 120, step):
        folder = tmp_path / str(number)
        shutil.copytree(was.before["identify"], folder)
        shutil.copytree(undisturbed.before["ingest"], folder, dirs_exist_ok=True)
        code, _ = killed_at_event("ingest", folder, number)
        now = outputs(folder)
        assert set(now.items()) <= {*old.items(), *new.items()}
        assert str(PROCESSED / "batch.json") not in now or now in (old, new)
        if code == 0:
            break
    assert code == 0
