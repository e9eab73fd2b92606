"""The comparison of solvers and resolvers on sets of problems (`taskopt bench run`, `report`, `diff`)."""
