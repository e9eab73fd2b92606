"""Benchmarks: one question a module."""
