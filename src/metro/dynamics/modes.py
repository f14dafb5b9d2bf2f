"""Modal constants from fitted poles and residues: frequency, damping, stiffness, mass, with errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.dynamics.polefit import PoleFit
from metro.dynamics.shapes import mpc
from metro.units import Array, ComplexArray

RESOLVED = 1.0 / 6.0  # relative standard deviation: a third, at 95 %


@dataclass(frozen=True)
class Mode:
    """A mode of vibration with its standard deviations.

    Attributes
    ----------
    frequency, frequency_sd : undamped natural frequency, Hz. (Printed "natural frequencies" are often the
        damped one.)
    damping, damping_sd : damping ratio.
    stiffness, stiffness_sd : at the driving point, N/m; NaN where there is no driving point, or where the
        residue there has the wrong sign for a mode of a passive structure.
    mass, mass_sd : stiffness / omega², kg.
    viscous, viscous_sd : 2 damping stiffness / omega, N s/m.
    shape : (c,) complex residues over the responses, scaled to 1 at the driving point (else at the largest).
    collinearity : modal phase collinearity of the shape fitted without the demand that the mode be real.
    resolved : whether the data determine damping, and stiffness at a driving point, to a third (95 %).
    """

    frequency: float
    frequency_sd: float
    damping: float
    damping_sd: float
    stiffness: float
    stiffness_sd: float
    mass: float
    mass_sd: float
    viscous: float
    viscous_sd: float
    shape: ComplexArray
    collinearity: float
    resolved: bool


def modal_constants(
    fit: PoleFit, r: int, driving: int | None, free: ComplexArray, decay: float = 0.0
) -> Mode:
    """Constants of mode ``r`` of a fit.

    Parameters
    ----------
    driving : response at the point and along the axis of the force.
    free : (c,) residues of the mode, fitted as complex.
    decay : 1/s, of an exponential window on force and response: poles are measured that much too far left.

    Raises
    ------
    ValueError
        When the window decays faster than the mode: its damping is confounded with the window's.
    """
    m = len(fit.omega)
    measured = complex(fit.poles[r])
    pole = measured + decay
    if pole.real >= 0.0:
        raise ValueError(
            f"mode at {measured.imag / (2.0 * np.pi):.1f} Hz: the exponential window decays faster than it"
        )
    omega, zeta = abs(pole), -pole.real / abs(pole)
    # change of the pole with (log omega, log zeta) as measured
    root = math.sqrt(1.0 - fit.zeta[r] ** 2)
    change = np.array([measured, fit.omega[r] * fit.zeta[r] * (-1.0 - 1j * fit.zeta[r] / root)])
    log_omega = np.real(change / pole)
    log_zeta = np.real(change) / pole.real - log_omega
    at = 0 if driving is None else driving

    def sd(by_pole: Array, by_residue: float = 0.0) -> float:
        gradient = np.zeros(3 * m)
        gradient[[r, m + r, 2 * m + r]] = [*by_pole, by_residue]
        return fit.sd(gradient, at)

    # H = sum of A/(s - p) + conj, and A = 1/(2 i m omega_d) for a real mode, so m = -1/(2 omega_d Im A)
    residue = float(fit.residues[r, at].imag)
    there = driving is not None and residue < 0.0
    mass = -0.5 / (pole.imag * residue) if there else math.nan
    log_mass = -np.imag(change) / pole.imag, -1.0 / residue if there else math.nan
    shape = fit.residues[r]
    damping_sd = sd(log_zeta)
    stiffness_sd = sd(log_mass[0] + 2.0 * log_omega, log_mass[1])
    return Mode(
        frequency=omega / (2.0 * np.pi),
        frequency_sd=omega / (2.0 * np.pi) * sd(log_omega),
        damping=zeta,
        damping_sd=zeta * damping_sd,
        stiffness=mass * omega**2,
        stiffness_sd=mass * omega**2 * stiffness_sd,
        mass=mass,
        mass_sd=mass * sd(*log_mass),
        viscous=2.0 * zeta * omega * mass,
        viscous_sd=2.0 * zeta * omega * mass * sd(log_mass[0] + log_omega + log_zeta, log_mass[1]),
        shape=shape / shape[int(np.abs(shape).argmax()) if driving is None else driving],
        collinearity=mpc(free),
        resolved=damping_sd < RESOLVED and (driving is None or stiffness_sd < RESOLVED),
    )
