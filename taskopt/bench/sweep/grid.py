"""The cases of a sweep: every combination of values, seeds and resolvers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from taskopt.errors import InvalidValue

_DECADE = 10.0  # ends that are positive and further apart than this are spaced on a logarithmic scale


class Axis(NamedTuple):
    """A parameter with the values that it takes.

    Attributes:
        address: Address of the parameter, such as "hand.weight".
        values: Texts of its values, as `taskopt run --set` takes them.
    """

    address: str
    values: tuple[str, ...]


class Case(NamedTuple):
    """One run of a sweep.

    Attributes:
        settings: Texts such as "hand.weight=0.1", one for each axis.
        seed: 0 for the start of the scenario, else the seed of a start near it.
        resolver: Name of the resolver.
    """

    settings: tuple[str, ...]
    seed: int
    resolver: str


def axis(text: str) -> Axis:
    """Read an axis from a text.

    Args:
        text: ADDRESS=VALUE, ADDRESS=VALUE,VALUE,…, or ADDRESS=FIRST..LAST:COUNT. If both ends are positive
            and differ by a factor of ten or more, the values are evenly spaced on a logarithmic scale.

    Returns:
        The axis.

    Raises:
        InvalidValue: The text has another form.
    """
    address, equals, values = text.partition("=")
    if not address or not equals or not values:
        raise InvalidValue(
            f"--set must have the form ADDRESS=VALUES, such as hand.weight=1e-3..1e3:13, got '{text}'"
        )
    if ".." not in values:
        return Axis(address, tuple(values.split(",")) if values[0] not in "[(" else (values,))
    ends, _, count = values.partition(":")
    first, _, last = ends.partition("..")
    try:
        low, high, number = float(first), float(last), int(count)
    except ValueError as error:
        raise InvalidValue(f"--set {text}: a range is FIRST..LAST:COUNT, such as 1e-3..1e3:13") from error
    if number < 2 or not np.isfinite([low, high]).all() or low == high:
        raise InvalidValue(f"--set {text}: a range needs two different finite ends and a count of at least 2")
    wide = min(low, high) > 0.0 and max(low, high) / min(low, high) >= _DECADE
    spaced = np.geomspace(low, high, number) if wide else np.linspace(low, high, number)
    return Axis(address, tuple(f"{value:.12g}" for value in spaced))


@dataclass(frozen=True)
class Grid:
    """All cases of a sweep.

    Attributes:
        axes: Parameters with their values.
        seeds: Number of starts: the scenario's own, and others near it.
        resolvers: Names of resolvers.

    Raises:
        InvalidValue: A parameter or a resolver is named twice, or there is no seed.
    """

    axes: tuple[Axis, ...]
    seeds: int = 1
    resolvers: tuple[str, ...] = ("active-set",)

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise InvalidValue(f"a sweep needs at least one seed, got {self.seeds}")
        for what, names in (("parameter", [one.address for one in self.axes]), ("resolver", self.resolvers)):
            twice = sorted({name for name in names if list(names).count(name) > 1})
            if twice:
                raise InvalidValue(f"name each {what} once; named twice: {', '.join(twice)}")

    def cases(self) -> Iterator[Case]:
        """Yield all cases in order: the first axis changes slowest, then the others, resolvers, and seeds."""
        choices: Sequence[Sequence[str]] = [
            [f"{one.address}={value}" for value in one.values] for one in self.axes
        ]
        for settings in product(*choices):
            for resolver in self.resolvers:
                for seed in range(self.seeds):
                    yield Case(settings, seed, resolver)
