"""Checks for user-written tasks, limits, objectives, solvers and resolvers; our own tests use them, too.

Each check tests a contract at random configurations or on random problems. It returns nothing if the contract
holds, and raises `AssertionError` if it does not; the message says what failed, where, and by how much. No
test framework is needed.
"""

from taskopt.testing.limit import check_limit as check_limit
from taskopt.testing.objective import check_objective as check_objective
from taskopt.testing.resolver import check_resolver as check_resolver
from taskopt.testing.solver import check_solver as check_solver
from taskopt.testing.task import check_task as check_task
