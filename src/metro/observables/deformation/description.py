"""What is said of the observable ``deformation``: title, assumptions of its model, and its needs."""

from __future__ import annotations

from metro.batch.capabilities import Capability, Stock, capability, count, missing_files, missing_roles
from metro.observables.deformation import NAME, TABLES
from metro.observables.description import Description


def needs(stock: Stock) -> tuple[Capability, ...]:
    """Return what a batch has and lacks for it."""
    traced, coefficients = stock.runs[stock.runs["profile"] != ""], stock.missing_coefficients()
    needs = [*missing_files(traced, "profile"), *stock.missing_arm()]
    if "joint_stiffness_nm_rad" not in stock.cell and stock.tables["loads"].empty:
        needs.append("loads.csv, or joint_stiffness_nm_rad in cell.yaml")
    if not (traced["robot_log"] != "").any():
        needs.append("robot_log in the runs that have a profile: the arm's pose")
    has_force = ((traced["idle_log"] != "") | (traced["dynamometer"] != "")).any()
    if coefficients and not has_force:
        needs += ["the force: idle_log or dynamometer in those runs, or", *coefficients]
    return (
        capability(
            "deformation", count(traced, "a profile"), needs, missing_roles(traced), measured=len(traced) > 0
        ),
    )


DESCRIPTION = Description(
    name=NAME,
    title="deformation of the wall",
    assumes=("The arm deforms at its joints alone, linearly; links, base and tool holder are rigid."),
    tables=TABLES,
    shown=(),
    drawn=(),
    needs=needs,
)
