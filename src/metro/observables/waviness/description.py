"""What is said of the observable ``waviness``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, count, missing_files, missing_roles
from metro.observables.description import Description
from metro.observables.waviness import NAME, TABLES


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    traced = stock.runs[stock.runs["profile"] != ""]
    needs = [*missing_files(traced, "profile"), *stock.missing_arm()]
    if not (traced["robot_log"] != "").any():
        needs.append("robot_log in the runs that have a profile")
    return (
        capability(
            "waviness", count(traced, "a profile"), needs, missing_roles(traced), measured=len(traced) > 0
        ),
    )


DESCRIPTION = Description(
    name=NAME,
    title="waviness of the wall",
    assumes=(
        "Waviness is predicted from the tracking error of the joints; vibration faster than the "
        "controller's log is not in it."
    ),
    tables=TABLES,
    shown=("waviness_points", "waviness_runs"),
    drawn=("waviness_points",),
    needs=needs,
)
