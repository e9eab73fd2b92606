"""Comparisons for users: accuracy of solvers, worth of strict levels, random stacks (`taskopt bench`)."""
