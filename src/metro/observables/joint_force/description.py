"""What is said of the observable ``joint_force``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import (
    Capability,
    Stock,
    capability,
    count,
    missing_files,
    missing_roles,
    plural,
)
from metro.observables.description import Description
from metro.observables.joint_force import NAME, OF_LOGS, TABLES


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
        _of_logs(stock),
    )


def _of_logs(stock: Stock) -> Capability:
    """Return what is there and lacking of logs of an arm that moves freely."""
    logs = stock.runs[stock.runs["joint_log"] != ""]
    wishes = [] if stock.has_arm() else ["arm.dh or arm.urdf in cell.yaml, for friction and payload"]
    states = set(logs["loaded"])
    if "yes" in states and "no" not in states:
        wishes.append("a joint_log with loaded: no, for the payload")
    source = f"{plural(len(logs), 'joint log')}"
    return capability("joints", source, missing_files(logs, "joint_log"), wishes, measured=len(logs) > 0)


DESCRIPTION = Description(
    name=NAME,
    title="tip force from joint torques",
    assumes=(
        "Tip forces come from motor torques above those of the idle run: friction that differs "
        "between the two runs is read as force."
    ),
    tables=TABLES,
    shown=("joint_friction", "joint_friction_curve", *OF_LOGS),
    drawn=(),
    needs=needs,
)
