"""Comparisons for users (`taskopt bench`): accuracy of solvers, strict levels, random stacks."""
