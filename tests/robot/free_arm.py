"""Logs of an arm that moves freely; its load is point masses that virtual work moves, without a regressor."""

import numpy as np

from metro.robot.kinematics import forward, jacobian
from metro.robot.rigid_body import torque_regressor

DH = np.array(
    [
        *([0, np.pi / 2, 0.1807, 0], [0, 0, 0, -0.6127], [0, 0, 0, -0.57155]),
        *([0, np.pi / 2, 0.17415, 0], [0, -np.pi / 2, 0.11985, 0], [0, 0, 0.11655, 0]),
    ]
)
MASSES = np.array([1.1, 0.9, 0.805])
PLACES = np.array([[0.05, 0.10, 0.02], [0.0, 0.22, 0.06], [0.04, 0.18, 0.05]])  # flange frame, m
MASS, CENTRE = MASSES.sum(), MASSES @ PLACES / MASSES.sum()
LINKS = np.tile([6.0, 0.9, 0.2, 0.3, 0.2, 0.01, 0.02, 0.25, 0.01, 0.15], 6) * np.repeat(
    [1.0, 2.0, 1.0, 0.4, 0.3, 0.1], 10
)
COULOMB = np.array([14.0, 15.0, 6.0, 2.5, 3.0, 2.5])
VISCOUS = np.array([18.0, 17.0, 8.0, 2.8, 2.1, 2.8])
NOISE = np.array([1.0, 1.0, 0.5, 0.1, 0.1, 0.1])


def motion(time, seed=1, turn=20.0):
    """Angles, rates and accelerations (m, 6) of five harmonics of ``turn`` s."""
    rng = np.random.default_rng(seed)
    amplitude, phase = rng.uniform(0.15, 0.45, (5, 6)), rng.uniform(0, 2 * np.pi, (5, 6))
    q, rate, rise = (np.zeros((len(time), 6)) for _ in range(3))
    for k in range(5):
        pulse = 2 * np.pi * (k + 1) / turn
        angle = pulse * time[:, None] + phase[k]
        size = amplitude[k] / np.sqrt(k + 1)
        q += size * np.sin(angle)
        rate += size * pulse * np.cos(angle)
        rise -= size * pulse**2 * np.sin(angle)
    return q + np.array([0, -1.2, 0.6, -1.0, 0.3, 0.0]), rate, rise


def bare(time, seed=1):
    """Angles and rates, torque of the links, and of Coulomb and viscous friction."""
    q, rate, rise = motion(time, seed)
    links = torque_regressor(DH, q, rate, rise) @ LINKS
    return q, rate, links, COULOMB * np.sign(rate) + VISCOUS * rate


def of_the_load(time, seed=1):
    """Torque (m, 6) of the point masses: their weight and inertia times what each joint moves them."""
    step = 1e-3
    torque = np.zeros((len(time), 6))
    for mass, place in zip(MASSES, PLACES, strict=True):

        def at(when, place=place):
            flange = forward(DH, motion(when, seed)[0])
            return flange[:, :3, :3] @ place + flange[:, :3, 3]

        rise = (at(time + step) - 2 * at(time) + at(time - step)) / step**2
        q = motion(time, seed)[0]
        moves = jacobian(DH, q)
        lever = at(time) - forward(DH, q)[:, :3, 3]
        point = moves[:, :3] + np.cross(np.moveaxis(moves[:, 3:], 1, 2), lever[:, None]).swapaxes(1, 2)
        torque += mass * np.einsum("maj,ma->mj", point, rise + np.array([0, 0, 9.81]))
    return torque
