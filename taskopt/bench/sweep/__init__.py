"""Sweeps of a scenario over parameters, starts and resolvers (`taskopt sweep`)."""
