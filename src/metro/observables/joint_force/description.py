"""What is said of the observable ``joint_force``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, count, missing_roles
from metro.observables.description import Description
from metro.observables.joint_force import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    runs = stock.runs
    logged = runs[(runs["robot_log"] != "") & (runs["idle_log"] != "")]
    logs = [] if len(logged) else ["robot_log and idle_log files of one run in runs.csv"]
    compared = logged[logged["dynamometer"] != ""]
    wishes = (
        missing_roles(compared) if len(compared) else ["a dynamometer file in the same runs, to compare with"]
    )
    measured = bool(((runs["robot_log"] != "") | (runs["idle_log"] != "")).any())
    needs = [*stock.missing_arm(), *logs]
    return (
        capability("joint force", count(logged, "robot_log and idle_log"), needs, wishes, measured=measured),
    )


DESCRIPTION = Description(
    name=NAME,
    title="tip force from joint torques",
    assumes=(
        "Tip forces come from motor torques above those of the idle run: friction that differs "
        "between the two runs is read as force."
    ),
    tables=TABLES,
    shown=("joint_friction", "joint_friction_curve"),
    drawn=(),
    needs=needs,
)
