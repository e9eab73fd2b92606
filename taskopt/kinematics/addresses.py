"""The parameters of a plan by address, such as "hand.weight", and the gates of its tasks."""

from collections.abc import Callable, Mapping, Sequence

from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block, numbered
from taskopt.hierarchy.problem import Hierarchy, LevelRows
from taskopt.kinematics.gate import Axes, Enabled, Gate, LevelEnabled, Weight
from taskopt.kinematics.limit import BoundLimit
from taskopt.kinematics.parameter import Followed, Parameter
from taskopt.kinematics.part import RowPart
from taskopt.kinematics.task import BoundTask
from taskopt.kinematics.task.level_damping import BoundLevelDamping


def rows_of_block(hierarchy: Hierarchy, block: Block) -> LevelRows:
    """Return the rows of one block.

    Args:
        hierarchy: The hierarchy.
        block: A block of its layout.

    Returns:
        Views of the rows.
    """
    parts = hierarchy.A, hierarchy.lower, hierarchy.upper, hierarchy.weight, hierarchy.label
    return LevelRows(*(array[block.rows] for array in parts))


def gates_of(
    tasks: Sequence[BoundTask], hierarchy: Hierarchy, blocks: Mapping[str, Block], *, once: bool
) -> dict[str, Gate]:
    """Return a gate for each task, and let the weights of tasks be those in the hierarchy.

    Args:
        tasks: Bound tasks.
        hierarchy: Hierarchy of the plan.
        blocks: Rows of the tasks, by name.
        once: True if a constant task writes its rows only once, as at first order.

    Returns:
        The gates by name of the task.
    """
    gates = {}
    for task in tasks:
        if not isinstance(task, BoundLevelDamping):
            rows = rows_of_block(hierarchy, blocks[task.name])
            task.weight = rows.weight
            gates[task.name] = Gate(rows, constant=task.constant and once)
    return gates


def parameters_of(
    levels: Sequence[Sequence[BoundTask]],
    gates: Mapping[str, Gate],
    limits: Sequence[BoundLimit | RowPart],
    write_constant: Callable[[], None],
) -> dict[str, Parameter]:
    """Return all parameters of a plan by address.

    Args:
        levels: Bound tasks, by level.
        gates: Gate of each task that has one, by name.
        limits: Bound limits.
        write_constant: Function to be called after a change of a limit that is filled only once.

    Returns:
        The parameters.

    Raises:
        InvalidValue: A task is named as a whole level is, or as a limit with the same parameter.
    """
    found: dict[str, Parameter] = {}
    for task in (task for level in levels for task in level):
        found |= {f"{task.name}.{attribute}": p for attribute, p in task.adjustable().items()}
        if gate := gates.get(task.name):
            address = f"{task.name}.enabled"
            found[f"{task.name}.weight"] = Weight(task, gate)
            found[f"{task.name}.axes"] = Axes(task, gate)
            found[address] = Enabled(address, [gate])
    for k, level in enumerate(levels, 1):
        address = f"level {k}.enabled"
        if address in found:
            raise InvalidValue(f"'level {k}' is the name of a whole level; give the task another name")
        found[address] = LevelEnabled(address, [gates[t.name] for t in level if t.name in gates])
    for name, limit in zip(numbered(limit.name for limit in limits), limits, strict=True):
        for attribute, p in limit.adjustable().items():
            address = f"{name}.{attribute}"
            if address in found:
                raise InvalidValue(f"'{name}' is the name of a task and of a limit; rename one of them")
            found[address] = Followed(p, write_constant) if limit.constant else p
    return found
