"""Wrong signs, factors and indices in the formulas of the chapter, each with the equation that it spoils.

`chapter.py` plants them. The test that has to notice a fault is not written here: it is the one that
the table in `docs/chapter.md` names for the equation.
"""

from faults import Fault

_JACOBIANS = "kinematics/analysis/jacobians.py"
_SINGULARITY = "kinematics/analysis/singularity.py"
_STATICS = "kinematics/analysis/statics.py"
_CHAIN = "kinematics/analysis/closed_chain.py"
_ELLIPSOID = "kinematics/analysis/ellipsoid.py"
_SKEW = "kinematics/orientation/skew.py"
_EULER = "kinematics/orientation/euler.py"
_AXIS = "kinematics/orientation/angle_axis.py"
_QUATERNION = "kinematics/orientation/quaternion.py"
_ERROR = "kinematics/task/orientation_error.py"
_FORMS = "resolver/closed_form.py"
_TRANSPOSE = "resolver/transpose.py"
_CONFIGURATION = "kinematics/configuration.py"
_ARMS = "kinematics/robot/arms.py"

_SHOULDER = """(0.0, _QUARTER, 0.0, "revolute"),
        (a2, 0.0, 0.0, "revolute"),
        (a3"""
_S = "[[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]"
_S_TRANSPOSED = "[[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]"
_W_CROSS_P = "joint_jacobians[0, c] + wy * pz - wz * py"
_PSEUDO_INVERSE = "(Vt[:r].T / sigma[:r]) @ U[:, :r].T"
_WEIGHTED = "return inverse @ pseudo_inverse(J @ inverse)"
_NULL_MOTION = "return pseudo_inverse(J) @ v + internal_motion(J, v0)"
_FIXED_ROWS = "J[3:] = angles.rates(angles.angles(configuration.pose(frame)[:3, :3]), J[3:])"
_TORQUE = 'return matrix.T @ finite("wrench", wrench, (matrix.shape[0],))'
_ANGLE_AXIS_ROWS = "_Rows(angle_axis_error(R_e, R_d), L, L.T @ omega_d, np.eye(3))"
_EULER_ROWS = "return _Rows(phi_d - phi, np.asarray(np.linalg.inv(T), dtype=np.float64), feedforward, eye)"
_QUATERNION_ROWS = "return _Rows(quaternion_error(R_e, R_d), np.eye(3), omega_d, np.eye(3))"

FAULTS: tuple[tuple[str, Fault], ...] = (
    (
        "3.1",
        Fault(
            "the frame stands elsewhere by twice its joint's place",
            _CONFIGURATION,
            "out[i, 3] += joint_translation[i]",
            "out[i, 3] += 2.0 * joint_translation[i]",
        ),
    ),
    (
        "3.2",
        Fault(
            "the velocity of a point beside the frame turns the wrong way",
            _JACOBIANS,
            "J[:3] -= skew(_arm(configuration, frame, point)) @ J[3:]",
            "J[:3] += skew(_arm(configuration, frame, point)) @ J[3:]",
        ),
    ),
    (
        "3.3",
        Fault(
            "the angular velocity is twice as large",
            _CONFIGURATION,
            "out[5, c] = wx, wy, wz",
            "out[5, c] = 2.0 * wx, 2.0 * wy, 2.0 * wz",
        ),
    ),
    (
        "3.5",
        Fault(
            "a sign of ω × p in a row of J_P", _CONFIGURATION, "+ wz * px - wx * pz", "+ wz * px + wx * pz"
        ),
    ),
    (
        "3.6",
        Fault(
            "ω from Ṙ Rᵀ is twice as large",
            _SKEW,
            "return 0.5 * np.array([S[2, 1]",
            "return 1.0 * np.array([S[2, 1]",
        ),
    ),
    ("3.7", Fault("S(ω) is not skew-symmetric", _SKEW, "[-y, x, 0.0]]", "[y, x, 0.0]]")),
    (
        "3.8",
        Fault("S(ω) has its x entries exchanged", _SKEW, _S, "[[0.0, -z, y], [z, 0.0, x], [-y, -x, 0.0]]"),
    ),
    ("3.9", Fault("S(ω) has the opposite sign", _SKEW, _S, _S_TRANSPOSED)),
    ("3.10", Fault("Ṙ = S(2 ω) R", _SKEW, _S, f"2.0 * np.array({_S})")),
    (
        "3.11",
        Fault("S(ω) has its y entries exchanged", _SKEW, _S, "[[0.0, -z, -y], [z, 0.0, -x], [y, x, 0.0]]"),
    ),
    ("3.14", Fault("a × b is b × a", _SKEW, _S, f"-np.array({_S})")),
    (
        "3.25",
        Fault(
            "a revolute joint turns its link the wrong way",
            _CONFIGURATION,
            "out[5, c] = wx, wy, wz",
            "out[5, c] = -wx, -wy, -wz",
        ),
    ),
    (
        "3.26",
        Fault(
            "ω × r has a wrong sign along x",
            _CONFIGURATION,
            _W_CROSS_P,
            "joint_jacobians[0, c] + wy * pz + wz * py",
        ),
    ),
    (
        "3.30",
        Fault(
            "z × (p_e − p) has a wrong sign along z",
            _CONFIGURATION,
            "+ wx * py - wy * px",
            "+ wx * py + wy * px",
        ),
    ),
    (
        "3.32",
        Fault(
            "a link is displaced along its own axis the wrong way",
            "kinematics/robot/dh.py",
            "[0.0, sa, ca, self.d],",
            "[0.0, -sa, ca, self.d],",
        ),
    ),
    (
        "3.34",
        Fault(
            "Rᵘ is its transpose",
            _JACOBIANS,
            "J[:3], J[3:] = R.T @ J[:3], R.T @ J[3:]",
            "J[:3], J[3:] = R @ J[:3], R @ J[3:]",
        ),
    ),
    (
        "3.35",
        Fault(
            "links of the planar arm point backwards",
            _ARMS,
            '(length, 0.0, 0.0, "revolute") for length in a.',
            '(-length, 0.0, 0.0, "revolute") for length in a.',
        ),
    ),
    (
        "3.37",
        Fault(
            "the shoulder of the anthropomorphic arm turns the other way",
            _ARMS,
            _SHOULDER,
            _SHOULDER.replace("_QUARTER", "-_QUARTER"),
        ),
    ),
    (
        "3.38",
        Fault(
            "the forearm has twice its length",
            _ARMS,
            '(a3, 0.0, 0.0, "revolute")',
            '(2.0 * a3, 0.0, 0.0, "revolute")',
        ),
    ),
    (
        "3.41",
        Fault(
            "links of the planar arm have twice their length",
            _ARMS,
            '(length, 0.0, 0.0, "revolute") for length in a.',
            '(2.0 * length, 0.0, 0.0, "revolute") for length in a.',
        ),
    ),
    (
        "3.42",
        Fault(
            "the Jacobian is moved away from the wrist",
            _SINGULARITY,
            "J[:3] -= skew(centre - p) @ J[3:]",
            "J[:3] += skew(centre - p) @ J[3:]",
        ),
    ),
    (
        "3.43",
        Fault("J₂₂ is twice as large", _SINGULARITY, "J[3:, wrist], centre)", "2.0 * J[3:, wrist], centre)"),
    ),
    (
        "3.44",
        Fault(
            "det J₁₁ has the wrong sign",
            _SINGULARITY,
            "return float(np.linalg.det(self.arm))",
            "return -float(np.linalg.det(self.arm))",
        ),
    ),
    (
        "3.45",
        Fault(
            "N(J) and R(Jᵀ) are exchanged",
            "kinematics/analysis/redundancy.py",
            "Vt[rank:].T, Vt[:rank].T",
            "Vt[:rank].T, Vt[rank:].T",
        ),
    ),
    (
        "3.46",
        Fault("P projects into R(Jᵀ)", _FORMS, "basis = Vt[_rank(sigma) :]", "basis = Vt[: _rank(sigma)]"),
    ),
    ("3.47", Fault("q̇ = J⁻ᵀ v", _FORMS, "np.linalg.solve(J, v)", "np.linalg.solve(J.T, v)")),
    (
        "3.48",
        Fault(
            "a step is twice as long",
            "kinematics/stack.py",
            "self.robot.integrate(q, mean, self.dt)",
            "self.robot.integrate(q, mean, 2.0 * self.dt)",
        ),
    ),
    ("3.49", Fault("W⁻¹ is left out on the left", _FORMS, _WEIGHTED, "return pseudo_inverse(J @ inverse)")),
    (
        "3.50",
        Fault(
            "W weighs in the other direction",
            _FORMS,
            _WEIGHTED,
            "return np.linalg.inv(inverse) @ pseudo_inverse(J @ np.linalg.inv(inverse))",
        ),
    ),
    ("3.51", Fault("q̇ = −J† v", _FORMS, _PSEUDO_INVERSE, f"-{_PSEUDO_INVERSE}")),
    (
        "3.52",
        Fault("singular values multiply", _FORMS, _PSEUDO_INVERSE, "(Vt[:r].T * sigma[:r]) @ U[:, :r].T"),
    ),
    (
        "3.53",
        Fault(
            "q̇₀ counts twice",
            _FORMS,
            _NULL_MOTION,
            "return pseudo_inverse(J) @ v + 2.0 * internal_motion(J, v0)",
        ),
    ),
    (
        "3.54",
        Fault(
            "q̇₀ is subtracted", _FORMS, _NULL_MOTION, "return pseudo_inverse(J) @ v - internal_motion(J, v0)"
        ),
    ),
    ("3.55", Fault("w is descended", _FORMS, "k0 * gradient)", "-k0 * gradient)")),
    (
        "3.56",
        Fault(
            "w is half the product",
            "kinematics/objective/manipulability.py",
            "sigma, w = np.zeros(m), 1.0",
            "sigma, w = np.zeros(m), 0.5",
        ),
    ),
    (
        "3.57",
        Fault(
            "w lacks its factor ½",
            "kinematics/objective/joint_range.py",
            "return -0.5 * float(np.mean(",
            "return -1.0 * float(np.mean(",
        ),
    ),
    (
        "3.58",
        Fault(
            "the distance has the wrong sign",
            "kinematics/objective/distance.py",
            "return nearest - self.temperature",
            "return -nearest - self.temperature",
        ),
    ),
    ("3.59", Fault("k is not squared", _FORMS, "(sigma**2 + damping**2)", "(sigma**2 + damping)")),
    ("3.60", Fault("J_A moves twice as far", _JACOBIANS, _FIXED_ROWS, f"J[:3] *= 2.0\n    {_FIXED_ROWS}")),
    ("3.62", Fault("J_φ has the wrong sign", _JACOBIANS, _FIXED_ROWS, f"{_FIXED_ROWS}\n    J[3:] *= -1.0")),
    (
        "3.64",
        Fault(
            "the axis of ϑ̇ points backwards",
            _EULER,
            "np.column_stack([np.eye(3)[a], first[:, b], second[:, c]])",
            "np.column_stack([np.eye(3)[a], -first[:, b], second[:, c]])",
        ),
    ),
    (
        "3.65",
        Fault(
            "T_A has T transposed",
            _JACOBIANS,
            "out[3:, 3:] = angles.rate_map(phi)",
            "out[3:, 3:] = angles.rate_map(phi).T",
        ),
    ),
    (
        "3.66",
        Fault(
            "J_φ = T J_O",
            _JACOBIANS,
            _FIXED_ROWS,
            "R = configuration.pose(frame)[:3, :3]\n    J[3:] = angles.rate_map(angles.angles(R)) @ J[3:]",
        ),
    ),
    ("3.67", Fault("e = x_e − x_d", _ERROR, _EULER_ROWS, _EULER_ROWS.replace("phi_d - phi", "phi - phi_d"))),
    (
        "3.70",
        Fault(
            "K e is subtracted",
            "kinematics/task/base.py",
            "return feedforward + gain * error",
            "return feedforward - gain * error",
        ),
    ),
    (
        "3.72",
        Fault(
            "the feedforward has the wrong sign",
            "kinematics/task/base.py",
            "return feedforward + gain * error",
            "return -feedforward + gain * error",
        ),
    ),
    ("3.76", Fault("q̇ = −Jᵀ K e", _TRANSPOSE, "torque = A.T @ (weight * b)", "torque = -A.T @ (weight * b)")),
    (
        "3.77",
        Fault("q̇ = 2 Jᵀ K e", _TRANSPOSE, "torque = A.T @ (weight * b)", "torque = 2.0 * A.T @ (weight * b)"),
    ),
    (
        "3.80",
        Fault(
            "e_O = 2 (φ_d − φ_e)",
            _ERROR,
            _EULER_ROWS,
            _EULER_ROWS.replace("phi_d - phi", "2.0 * (phi_d - phi)"),
        ),
    ),
    (
        "3.81",
        Fault(
            "φ̇_d has the wrong sign",
            _ERROR,
            _EULER_ROWS,
            _EULER_ROWS.replace("feedforward, eye", "-feedforward, eye"),
        ),
    ),
    (
        "3.82",
        Fault(
            "J_φ = T J_O in the rows",
            _ERROR,
            _EULER_ROWS,
            _EULER_ROWS.replace("np.asarray(np.linalg.inv(T), dtype=np.float64)", "T"),
        ),
    ),
    ("3.83", Fault("e_O points away", _AXIS, "np.cross(R_e, R_d, axis=0)", "np.cross(R_d, R_e, axis=0)")),
    (
        "3.84",
        Fault(
            "the axis points backwards",
            _AXIS,
            "return angle, vector / angle if",
            "return angle, -vector / angle if",
        ),
    ),
    ("3.85", Fault("e_O lacks its factor ½", _AXIS, "return 0.5 * np.cross(", "return 1.0 * np.cross(")),
    ("3.86", Fault("L has the wrong sign", _AXIS, "return -0.5 * sum((skew", "return 0.5 * sum((skew")),
    (
        "3.87",
        Fault(
            "L is its transpose",
            _AXIS,
            "(skew(R_d[:, k]) @ skew(R_e[:, k]) for",
            "(skew(R_e[:, k]) @ skew(R_d[:, k]) for",
        ),
    ),
    (
        "3.88",
        Fault("L ω_d in place of Lᵀ ω_d", _ERROR, _ANGLE_AXIS_ROWS, _ANGLE_AXIS_ROWS.replace("L.T", "L")),
    ),
    (
        "3.89",
        Fault("L is left out", _ERROR, _ANGLE_AXIS_ROWS, _ANGLE_AXIS_ROWS.replace(", L, ", ", np.eye(3), ")),
    ),
    (
        "3.90",
        Fault("ε₂ × ε₁ in the product", _QUATERNION, "np.cross(a[1:], b[1:])", "np.cross(b[1:], a[1:])"),
    ),
    (
        "3.91",
        Fault(
            "S(ε_d) ε_e has the wrong sign",
            _QUATERNION,
            "- skew(Q_d[1:]) @ Q_e[1:]",
            "+ skew(Q_d[1:]) @ Q_e[1:]",
        ),
    ),
    (
        "3.92",
        Fault(
            "ω_d has the wrong sign",
            _ERROR,
            _QUATERNION_ROWS,
            _QUATERNION_ROWS.replace("omega_d", "-omega_d"),
        ),
    ),
    (
        "3.93",
        Fault(
            "the error of the quaternion counts twice",
            _ERROR,
            _QUATERNION_ROWS,
            _QUATERNION_ROWS.replace("quaternion_error(R_e, R_d)", "2.0 * quaternion_error(R_e, R_d)"),
        ),
    ),
    ("3.94", Fault("η̇ has the wrong sign", _QUATERNION, "[-epsilon @ omega]", "[epsilon @ omega]")),
    (
        "3.95",
        Fault(
            "S(ε) has the wrong sign",
            _QUATERNION,
            "(eta * np.eye(3) - skew(epsilon))",
            "(eta * np.eye(3) + skew(epsilon))",
        ),
    ),
    ("3.96", Fault("V is halved", _QUATERNION, "return float(min(", "return 0.5 * float(min(")),
    (
        "3.97",
        Fault(
            "Δε takes the long way round",
            _QUATERNION,
            "return error if Q_d @ Q_e >= 0.0 else -error",
            "return -error if Q_d @ Q_e >= 0.0 else error",
        ),
    ),
    (
        "3.98",
        Fault(
            "J̇ of a point beside the frame has a wrong sign",
            _JACOBIANS,
            "rate[:3] -= skew(arm) @ rate[3:] +",
            "rate[:3] += skew(arm) @ rate[3:] +",
        ),
    ),
    (
        "3.110",
        Fault("torques do half the work", _STATICS, _TORQUE, _TORQUE.replace("matrix.T", "0.5 * matrix.T")),
    ),
    ("3.111", Fault("τ = −Jᵀ γ", _STATICS, _TORQUE, _TORQUE.replace("matrix.T", "-matrix.T"))),
    (
        "3.112",
        Fault("S(r) has the wrong sign", _STATICS, "out[:3, 3:] = -R @ skew", "out[:3, 3:] = R @ skew"),
    ),
    ("3.113", Fault("R₁² is its transpose", _STATICS, "R = T[:3, :3].T", "R = T[:3, :3]")),
    (
        "3.116",
        Fault(
            "the force transformation is not transposed",
            _STATICS,
            "return velocity_transform(pose).T",
            "return velocity_transform(pose)",
        ),
    ),
    (
        "3.119",
        Fault("∂q_u/∂q_a has the wrong sign", _CHAIN, "follow = -np.linalg.pinv", "follow = np.linalg.pinv"),
    ),
    (
        "3.120",
        Fault(
            "τ_a has the wrong sign",
            _CHAIN,
            'return matrix.T @ finite("torques"',
            'return -matrix.T @ finite("torques"',
        ),
    ),
    (
        "3.121",
        Fault(
            "τ_a counts twice",
            _CHAIN,
            'return matrix.T @ finite("torques"',
            'return 2.0 * matrix.T @ finite("torques"',
        ),
    ),
    (
        "3.123",
        Fault(
            "the axes of the ellipsoid are transposed", _ELLIPSOID, "return U, sigma\n", "return U.T, sigma\n"
        ),
    ),
    (
        "3.124",
        Fault(
            "w is the sum of the singular values",
            _SINGULARITY,
            "return float(np.prod(self.singular_values))",
            "return float(np.sum(self.singular_values))",
        ),
    ),
    (
        "3.126",
        Fault(
            "the force ellipsoid is twice as large",
            _ELLIPSOID,
            "np.divide(1.0, sigma",
            "np.divide(2.0, sigma",
        ),
    ),
    ("3.127", Fault("α is its inverse", _ELLIPSOID, "return 1.0 / size if size", "return size if size")),
    (
        "3.128",
        Fault(
            "β is its inverse",
            _ELLIPSOID,
            "return float(1.0 / np.linalg.norm(",
            "return float(np.linalg.norm(",
        ),
    ),
)
"""The equation that each fault spoils, and the fault."""
