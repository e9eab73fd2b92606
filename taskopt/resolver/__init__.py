"""Resolvers: (hierarchy, memory) → (resolution, memory), and their names."""
