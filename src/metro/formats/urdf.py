"""The joints of a robot from a URDF file: the chain from its base to its tip."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

from metro.formats.errors import FormatError
from metro.units import Array

KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed"}
LARGEST = 1 << 24  # bytes: a description with all its meshes' names has less than one


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint: name, kind (revolute, prismatic, fixed), ``origin`` (4, 4) in m, ``axis`` (3,) unit vector."""

    name: str
    kind: str
    origin: Array
    axis: Array


def read_urdf(path: Path, base: str = "", tip: str = "") -> list[UrdfJoint]:
    """Read the joints from the link ``base`` to the link ``tip``; "" for the root, and for the only end.

    Raises
    ------
    FormatError
        Naming the joint or link, and what was expected.
    """
    root = _parsed(path)
    joints = root.findall("joint")
    links = {str(link.get("name")) for link in root.findall("link")}
    if not joints:
        raise FormatError(path, "found no joint, expected <joint> elements in <robot>")
    by_child: dict[str, Xml.Element] = {}
    for joint in joints:
        child = _link(path, joint, "child")
        if child in by_child:
            both = f"{by_child[child].get('name')} and {joint.get('name')}"
            raise FormatError(path, f'link "{child}" is the child of {both}, expected a tree')
        by_child[child] = joint
    parents = {_link(path, joint, "parent") for joint in joints}
    for name in (base, tip):
        if name and name not in links | parents | set(by_child):
            raise FormatError(path, f'has no link "{name}", expected one of {", ".join(sorted(links))}')
    end = tip or _only_end(path, by_child, parents)
    chain: list[Xml.Element] = []
    link = end
    while link in by_child and link != base:
        if len(chain) > len(joints):
            raise FormatError(path, f'the links around "{link}" make a loop, expected a tree')
        chain.append(by_child[link])
        link = _link(path, by_child[link], "parent")
    if base and link != base:
        raise FormatError(path, f'link "{base}" does not carry "{end}", expected one of the links that do')
    read = [_joint(path, joint) for joint in reversed(chain)]
    if not any(joint.kind != "fixed" for joint in read):
        raise FormatError(
            path, f'no joint moves between "{link}" and "{end}", expected an arm: name tip_link'
        )
    return read


def _parsed(path: Path) -> Xml.Element:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(path, f"cannot be opened: {error.strerror}") from error
    if len(data) > LARGEST:
        raise FormatError(path, f"has {len(data)} bytes, expected a URDF file of less than {LARGEST}")
    if b"<!ENTITY" in data or b"<!DOCTYPE" in data:
        raise FormatError(path, "declares entities of its own, expected plain XML")
    if b"xacro:" in data:
        raise FormatError(path, "is a xacro file, expected URDF: write it by xacro robot.xacro > robot.urdf")
    try:
        root = Xml.fromstring(data)
    except Xml.ParseError as error:
        raise FormatError(path, f"is no XML: {error}") from error
    if root.tag != "robot":
        raise FormatError(path, f"starts with <{root.tag}>, expected <robot> of a URDF file")
    return root


def _only_end(path: Path, by_child: dict[str, Xml.Element], parents: set[str]) -> str:
    """Return the link at the end of the chain, where there is one that joints which move lead to."""
    ends = sorted(set(by_child) - parents)
    if len(ends) == 1:
        return ends[0]
    listed = ", ".join(ends[:20])
    raise FormatError(path, f"has {len(ends)} ends ({listed}), expected arm.tip_link to name the flange")


def _link(path: Path, joint: Xml.Element, which: str) -> str:
    element = joint.find(which)
    if element is None or not element.get("link"):
        raise FormatError(path, f'joint "{joint.get("name")}": has no <{which} link="…">')
    return str(element.get("link"))


def _joint(path: Path, joint: Xml.Element) -> UrdfJoint:
    name, kind = str(joint.get("name")), str(joint.get("type"))
    if kind not in KINDS:
        raise FormatError(path, f'joint "{name}": found the type "{kind}", expected {", ".join(KINDS)}')
    if joint.find("mimic") is not None:
        raise FormatError(path, f'joint "{name}": follows another joint (mimic), expected a serial arm')
    origin, axis = joint.find("origin"), joint.find("axis")
    place = np.eye(4)
    if origin is not None:
        place[:3, 3] = _three(path, name, "origin xyz", origin.get("xyz") or "0 0 0")
        place[:3, :3] = _turn(*_three(path, name, "origin rpy", origin.get("rpy") or "0 0 0"))
    direction = np.array(
        _three(path, name, "axis xyz", "1 0 0" if axis is None else axis.get("xyz") or "1 0 0")
    )
    size = float(np.linalg.norm(direction))
    if KINDS[kind] != "fixed" and size == 0.0:
        raise FormatError(path, f'joint "{name}", axis xyz: found 0 0 0, expected a direction')
    return UrdfJoint(name, KINDS[kind], place, direction / (size or 1.0))


def _three(path: Path, name: str, what: str, text: str) -> list[float]:
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise FormatError(path, f'joint "{name}", {what}: found "{text}", expected three numbers')
    return values


def _turn(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation Rz(yaw) Ry(pitch) Rx(roll), as URDF has it; angles in rad."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix())
