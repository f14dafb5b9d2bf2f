"""All that a batch of an arm of the harder world may hide, and where each is seen."""

from __future__ import annotations

from collections.abc import Mapping

from virtual_cell.hidden import Hidden
from virtual_cell.world.arm.body_faults import BODY_FAULTS
from virtual_cell.world.arm.drive_faults import DRIVE_FAULTS
from virtual_cell.world.arm.effects import LIBRARY
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.arm.trace_faults import TRACE_FAULTS

ARM_CAUSES: Mapping[str, Hidden[Robot]] = {**LIBRARY, **DRIVE_FAULTS, **BODY_FAULTS, **TRACE_FAULTS}
SHOWN: Mapping[str, tuple[str, ...]] = {
    "joint_force": (
        *("clock_offset", "friction_reversal", "friction_warmup", "gear_ripple", "payload_error"),
        *("tool_offset_error", *DRIVE_FAULTS),
    ),
    "deformation": (
        *("tool_offset_error", "joint_backlash", "stiffness_scale", "stiffness_hardening"),
        *("loose_base_bolt", "stretched_encoder_belt", "blended_corners", "sun_on_the_forearm"),
        *("creeping_shim", "slipping_work", "loose_dynamometer", "coolant_jet", "taut_cable"),
        *("torn_hose_bracket", "worn_traverse", "warming_pickup", "skid_beside_the_stylus"),
    ),
    "waviness": (
        *("friction_reversal", "gear_ripple", "path_vibration"),
        *("slipping_work", "lighter_work_rings", "fluttering_wall", "hard_bands", "sticking_joint"),
        *("knocking_valve", "beating_belt", "torn_hose_bracket"),
        *("worn_traverse", "welded_chips"),
    ),
}
