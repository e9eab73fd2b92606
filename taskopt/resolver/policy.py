"""What may be done where hard limits contradict each other; `resolver.settle` does it."""

from typing import Literal, get_args

from taskopt.errors import UnknownName

# "raise" `Infeasible`; "relax" the limits by the least that lets them agree; "brake" to standstill.
Policy = Literal["raise", "relax", "brake"]


def checked_policy(name: str) -> Policy:
    """The policy of that name; raise `UnknownName`."""
    for known in get_args(Policy):
        if known == name:
            return known
    raise UnknownName("policy for a conflict", name, get_args(Policy))
