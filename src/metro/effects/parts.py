"""The parts that models share: what an effect of several observables may change, whichever the model is."""

from __future__ import annotations

from dataclasses import Field
from typing import Any, ClassVar, Protocol, runtime_checkable

from metro.robot.drive_torques import DriveTorques
from metro.robot.kinematics import Arm
from metro.robot.torsion import Torsion


class Changeable(Protocol):
    """A frozen dataclass, of which ``dataclasses.replace`` makes a changed copy."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


class WithArm(Changeable, Protocol):
    """A model of an arm whose geometry is known."""

    @property
    def arm(self) -> Arm:
        """Geometry of the arm."""
        ...


class WithDrives(Changeable, Protocol):
    """A model of an arm whose drives and gears carry more than in the idle run."""

    @property
    def drives(self) -> DriveTorques:
        """Torques that the idle run does not have."""
        ...


@runtime_checkable
class WithTorsion(Changeable, Protocol):
    """A model of an arm with elastic joints."""

    @property
    def torsion(self) -> Torsion:
        """What the joints do beyond linear springs."""
        ...


class Stiffness(Changeable, Protocol):
    """What a model knows of how stiff the machine is in the cut."""

    @property
    def stiffness_factor(self) -> float:
        """Stiffness in the cut relative to that of the load tests."""
        ...


class WithStructure(Changeable, Protocol):
    """A model of a machine that gives way in the cut."""

    @property
    def structure(self) -> Stiffness:
        """How stiff the machine is."""
        ...
