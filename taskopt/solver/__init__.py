"""Solvers of one quadratic program, a file each, and their table."""
