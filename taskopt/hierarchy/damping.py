"""How much to damp near a singularity: policies that give k² of (3.59) for every singular direction.

A policy sees the singular values σ of a level's rows (as they stand in the null space of the levels
before, √w times the row, in the metric of the norm) and what the level asks for, and answers with k²:

    z = Σ σ_i / (σ_i² + k_i²) v_i u_iᵀ b,

which for one k is J* b (3.59). k² stands in the cost as ½ k² ‖q̇‖², beside ½ ‖b − J q̇‖². It acts in
the inverse only: what lower levels may still do is decided by the true null space.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from taskopt.arrays import Array, positive


class Damping(Protocol):
    """k² ≥ 0 for each singular value."""

    name: ClassVar[str]

    def __call__(self, sigma: Array, b: Array) -> Array:
        """k² (r,) for σ (r,), falling; b (m,) is what the level asks for, Uᵀ not yet applied."""
        ...


@dataclass(frozen=True)
class NoDamping:
    """k = 0: exact, with velocities that grow as 1/σ."""

    name: ClassVar[str] = "none"

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        return np.zeros_like(sigma)


@dataclass(frozen=True)
class ConstantDamping:
    """k² everywhere (3.59): velocities stay below ‖b‖/(2 k), and every task is missed a little.

    Nakamura and Hanafusa (1986); Wampler (1986), IEEE Trans. SMC 16(1).
    """

    k: float = 0.05
    name: ClassVar[str] = "constant"

    def __post_init__(self) -> None:
        positive("damping k", self.k)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        return np.full_like(sigma, self.k**2)


@dataclass(frozen=True)
class NakamuraHanafusa:
    """k² = k0² (1 − w/w0)² where w < w0, else 0, with w = √det(J Jᵀ) = Π σ, the manipulability (3.56).

    `k0`: more bounds the velocity lower at the singularity; `w0`: larger starts earlier. Nakamura and
    Hanafusa (1986), J. Dynamic Systems, Measurement and Control 108(3).
    """

    k0: float = 0.1
    w0: float = 0.01
    name: ClassVar[str] = "nakamura-hanafusa"

    def __post_init__(self) -> None:
        positive("k0", self.k0)
        positive("w0", self.w0)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        w = float(np.prod(sigma))
        return np.full_like(sigma, (self.k0 * max(0.0, 1.0 - w / self.w0)) ** 2)


@dataclass(frozen=True)
class Chiaverini:
    """k² = k_max² (1 − (σ_min/ε)²) where σ_min < ε, else 0, the same for every direction.

    `epsilon`: the smallest singular value at which damping starts. Chiaverini, Siciliano and Egeland
    (1994), IEEE Trans. Control Systems Technology 2(2).
    """

    k_max: float = 0.05
    epsilon: float = 0.05
    name: ClassVar[str] = "chiaverini"

    def __post_init__(self) -> None:
        positive("k_max", self.k_max)
        positive("epsilon", self.epsilon)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        least = float(sigma.min(initial=np.inf))
        return np.full_like(sigma, self.k_max**2 * max(0.0, 1.0 - (least / self.epsilon) ** 2))


@dataclass(frozen=True)
class NumericalFiltering:
    """k_i² = k_max² (1 − (σ_i/ε)²) where σ_i < ε, else 0: only directions about to be lost are damped.

    With one small singular value it is the filter of Maciejewski and Klein (1988), J. Robotic Systems
    5(6), with the factor of `Chiaverini`; each further one gets its own share, so that nothing jumps
    where two cross.
    """

    k_max: float = 0.05
    epsilon: float = 0.05
    name: ClassVar[str] = "filtering"

    def __post_init__(self) -> None:
        positive("k_max", self.k_max)
        positive("epsilon", self.epsilon)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        return self.k_max**2 * np.maximum(0.0, 1.0 - (sigma / self.epsilon) ** 2)


@dataclass(frozen=True)
class Sugihara:
    """k² = ½ ‖e‖² + bias: by the error, not by the singularity; near the goal it all but vanishes.

    A level asks for b = ẋ_d + K e; e is read back as b / `gain`, which is exact for a target at rest,
    one gain K [1/s] and weights of one, and takes a moving target's feedforward for error. Sugihara
    (2011), IEEE Trans. Robotics 27(5).
    """

    gain: float = 1.0
    bias: float = 1e-3
    name: ClassVar[str] = "sugihara"

    def __post_init__(self) -> None:
        positive("gain", self.gain)
        positive("bias", self.bias)

    def __call__(self, sigma: Array, b: Array) -> Array:
        return np.full_like(sigma, 0.5 * float(b @ b) / self.gain**2 + self.bias)


NONE, CONSTANT = NoDamping(), ConstantDamping()
POLICIES = (CONSTANT, NakamuraHanafusa(), Chiaverini(), NumericalFiltering(), Sugihara())
