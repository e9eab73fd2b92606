"""Analysis of a robot at q: Jacobians, singularities, redundancy, statics, closed chains, ellipsoids."""
