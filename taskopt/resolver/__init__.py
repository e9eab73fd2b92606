"""Resolvers, which are functions (hierarchy, memory) → (resolution, memory), and their names."""
