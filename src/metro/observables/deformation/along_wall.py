"""Where an arm is along a wall or in its load tests: what depends on its geometry alone, looked up once.

Fits that move the tip or take another arm's stiffness ask for the same places of the same flange again and
again.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from metro.observables.deformation.setting import CutWall, LoadTest
from metro.robot.kinematics import Arm, Geometry, forward
from metro.robot.statics import Flange, flange_of, joint_torque, moving_jacobian_of, tip_jacobian_of
from metro.same import Same
from metro.surface.profile import gaussian_filter
from metro.units import Array


@lru_cache(maxsize=1024)
def static(arm: Arm, flange_rotation: float, setting: CutWall | LoadTest) -> tuple[Array, Array]:
    """Displacement of the tip per turn of each joint (m, 3, n), and the torques of the force on it (m, n)."""
    flange = _flange(Same(arm.dh), setting)
    torque = -joint_torque(tip_jacobian_of(arm, flange), setting.force)
    return moving_jacobian_of(arm, flange, flange_rotation), torque


@lru_cache(maxsize=1024)
def outwards(arm: Arm, flange_rotation: float, setting: CutWall) -> tuple[Array, Array]:
    """Displacement of the tip out of the wall per turn of each joint (m, n), and the torques of the force."""
    moved, torque = static(arm, flange_rotation, setting)
    return np.einsum("a,mai->mi", setting.normal, moved), torque


@lru_cache(maxsize=256)
def strayed(arm: Arm, setting: CutWall) -> Array:
    """Tracking error of the tip along the wall's normal, (m,) m."""
    turned, moved = _off_path(Same(arm.dh), setting)
    return np.asarray((turned @ arm.tool + moved) @ arm.work[:3, :3] @ setting.normal)


@lru_cache(maxsize=32)
def profile_filter(points: int, spacing: float, cutoff: float) -> Array:
    """Return the filter of the profile as a matrix (points, points)."""
    return gaussian_filter(np.eye(points), spacing, cutoff)


@lru_cache(maxsize=256)
def _flange(dh: Same[Geometry], setting: CutWall | LoadTest) -> Flange:
    """Return the flange where it was commanded to be; forces of another size are on the same flange."""
    return flange_of(dh.value, setting.commanded if isinstance(setting, CutWall) else setting.joints)


@lru_cache(maxsize=256)
def _off_path(dh: Same[Geometry], setting: CutWall) -> tuple[Array, Array]:
    """By how much the flange is turned, (m, 3, 3), and moved, (m, 3) m, from where it was commanded to be."""
    off = forward(dh.value, setting.actual) - forward(dh.value, setting.commanded)
    return off[:, :3, :3], off[:, :3, 3]
