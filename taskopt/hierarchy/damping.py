"""Damping near singularities by policies that choose k² of (3.59) for every singular direction.

A policy gets the right-hand side b of a level and the singular values σ of its rows. These rows are first
projected into the null space of the levels before, multiplied by √w, and taken in the metric of the norm.
Rows that no unknown moves, such as the height of a planar arm's tip, are left out, since their σ = 0 says
nothing about a singularity. The policy returns k², and the level is then solved with

    z = Σ_i σ_i / (σ_i² + k_i²) v_i u_iᵀ b,

where u_i and v_i are the left and right singular vectors. This is J* b of (3.59) if all k_i are the same; the
cost is then ½ ‖b − J q̇‖² + ½ k² ‖q̇‖². Damping acts on the inverse only: lower levels still get the undamped
null space.

Source: Siciliano, Sciavicco, Villani and Oriolo (2009), "Robotics: Modelling, Planning and Control",
Sect. 3.5; equation numbers in parentheses are theirs.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from taskopt.arrays import Array, positive


class Damping(Protocol):
    """A policy that chooses k² ≥ 0 for each singular value.

    Attributes:
        name: Short name, for tables and plots.
    """

    name: ClassVar[str]

    def __call__(self, sigma: Array, b: Array) -> Array:
        """Return k² for each singular value.

        Args:
            sigma: Singular values σ of the level, falling, (r,).
            b: Right-hand side of the level, each row multiplied by √w, (m,).

        Returns:
            k², (r,), in the unit of σ².
        """
        ...


@dataclass(frozen=True)
class NoDamping:
    """No damping, k = 0: tasks are met exactly, with velocities that grow as 1/σ."""

    name: ClassVar[str] = "none"

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        """Return zeros, (r,); see `Damping`."""
        return np.zeros_like(sigma)


@dataclass(frozen=True)
class ConstantDamping:
    """The same k² everywhere (3.59): velocities are at most ‖b‖/(2 k), and every task has a small error.

    Attributes:
        k: Damping factor, in the unit of σ. Larger values give slower and smoother motions.

    Raises:
        InvalidValue: k is not a positive number.

    Source:
        Nakamura and Hanafusa (1986), J. Dynamic Systems, Measurement and Control 108(3); Wampler (1986),
        IEEE Trans. Systems, Man, and Cybernetics 16(1).
    """

    k: float = 0.05
    name: ClassVar[str] = "constant"

    def __post_init__(self) -> None:
        positive("damping k", self.k)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        """Return k² for each singular value, (r,); see `Damping`."""
        return np.full_like(sigma, self.k**2)


@dataclass(frozen=True)
class NakamuraHanafusa:
    """Damping by manipulability, w = √det(J Jᵀ) (3.56): k² = k0² (1 − w/w0)² where w < w0, else 0.

    w is the product of the singular values. A level with more rows than free directions has det(J Jᵀ) = 0 at
    every posture; w is then √det(Jᵀ J), with J restricted to these directions.

    Attributes:
        k0: Damping factor at the singularity, in the unit of σ. Larger values give lower velocities there.
        w0: Manipulability at which damping starts. Larger values make it start earlier.

    Raises:
        InvalidValue: k0 or w0 is not a positive number.

    Source:
        Nakamura and Hanafusa (1986), J. Dynamic Systems, Measurement and Control 108(3).
    """

    k0: float = 0.1
    w0: float = 0.01
    name: ClassVar[str] = "nakamura-hanafusa"

    def __post_init__(self) -> None:
        positive("k0", self.k0)
        positive("w0", self.w0)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        """Return the same k² for each singular value, (r,); see `Damping`."""
        w = float(np.prod(sigma))
        return np.full_like(sigma, (self.k0 * max(0.0, 1.0 - w / self.w0)) ** 2)


@dataclass(frozen=True)
class Chiaverini:
    """Damping by the smallest singular value: k² = k_max² (1 − (σ_min/ε)²) where σ_min < ε, else 0.

    Attributes:
        k_max: Damping factor at the singularity, in the unit of σ. Larger values give lower velocities there.
        epsilon: Value ε of the smallest singular value below which damping starts. Larger values make it
            start earlier.

    Raises:
        InvalidValue: k_max or epsilon is not a positive number.

    Source:
        Chiaverini, Siciliano and Egeland (1994), IEEE Trans. Control Systems Technology 2(2).
    """

    k_max: float = 0.05
    epsilon: float = 0.05
    name: ClassVar[str] = "chiaverini"

    def __post_init__(self) -> None:
        positive("k_max", self.k_max)
        positive("epsilon", self.epsilon)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        """Return the same k² for each singular value, (r,); see `Damping`."""
        least = float(sigma.min(initial=np.inf))
        return np.full_like(sigma, self.k_max**2 * max(0.0, 1.0 - (least / self.epsilon) ** 2))


@dataclass(frozen=True)
class NumericalFiltering:
    """Damping of the nearly lost directions only: k_i² = k_max² (1 − (σ_i/ε)²) where σ_i < ε, else 0.

    If one singular value is small, this is numerical filtering with the factor of `Chiaverini`. Every further
    small singular value has a factor of its own, so that velocities do not jump when two singular values
    cross.

    Attributes:
        k_max: Damping factor where σ_i = 0, in the unit of σ. Larger values give lower velocities there.
        epsilon: Singular value ε below which a direction is damped. Larger values make damping start earlier.

    Raises:
        InvalidValue: k_max or epsilon is not a positive number.

    Source:
        Maciejewski and Klein (1988), J. Robotic Systems 5(6).
    """

    k_max: float = 0.05
    epsilon: float = 0.05
    name: ClassVar[str] = "filtering"

    def __post_init__(self) -> None:
        positive("k_max", self.k_max)
        positive("epsilon", self.epsilon)

    def __call__(self, sigma: Array, b: Array) -> Array:  # noqa: ARG002 (protocol)
        """Return k² for each singular value, (r,); see `Damping`."""
        return self.k_max**2 * np.maximum(0.0, 1.0 - (sigma / self.epsilon) ** 2)


@dataclass(frozen=True)
class Sugihara:
    """Damping by the error e of the task, which nearly vanishes at the goal: k² = ½ ‖e‖² + bias.

    A level has the right-hand side b = ẋ_d + K e, and e is computed as b / `gain`. This is exact for a target
    at rest, a single gain K and weights of one; the feedforward ẋ_d of a moving target counts as a part of
    the error.

    Attributes:
        gain: Gain K of the task [1/s].
        bias: Constant part of k², in the unit of σ².

    Raises:
        InvalidValue: `gain` or `bias` is not a positive number.

    Source:
        Sugihara (2011), IEEE Trans. Robotics 27(5).
    """

    gain: float = 1.0
    bias: float = 1e-3
    name: ClassVar[str] = "sugihara"

    def __post_init__(self) -> None:
        positive("gain", self.gain)
        positive("bias", self.bias)

    def __call__(self, sigma: Array, b: Array) -> Array:
        """Return the same k² for each singular value, (r,); see `Damping`."""
        return np.full_like(sigma, 0.5 * float(b @ b) / self.gain**2 + self.bias)


@dataclass(frozen=True)
class RestDamping:
    """Let the robot rest where tasks cannot be met; there is nothing to tune.

    At a tick at which a level is near a loss of rank, and cannot meet what is asked for, rows of damping
    stand in the hierarchy: `rest of level k` in level k, and `free directions of level k` in level k + 1. See
    `taskopt.hierarchy.rest` for the formulas, and `taskopt.hierarchy.rest_bend` for those of order 2, where
    free directions need no rows of their own. All other ticks are without damping.
    """

    name: ClassVar[str] = "rest"


REST = RestDamping()
"""The default of a stack: an object of its own, so that a stack of order 2 tells it from one asked for."""
NONE, CONSTANT = NoDamping(), ConstantDamping()
POLICIES = (CONSTANT, NakamuraHanafusa(), Chiaverini(), NumericalFiltering(), Sugihara())
