"""The deletion filter leaves no side in a conflict that the others do without."""

from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.resolver.infeasible import find_conflict


def test_of_two_upper_bounds_below_a_lower_one_a_conflict_names_one() -> None:
    """x ≥ 1 contradicts x ≤ 0 and x ≤ 0.1 alike: three sides have gaps in phase one, two are in conflict."""
    limits = Level([[1.0], [1.0], [1.0]], lower=[1.0, -9.0, -9.0], upper=[9.0, 0.0, 0.1])
    conflict = find_conflict(Hierarchy([Level([[1.0]], [0.0])], limits=limits))
    assert conflict is not None
    assert len(conflict.relaxation) == 3
    assert sorted(side.side for side in conflict.members) == ["lower", "upper"]
