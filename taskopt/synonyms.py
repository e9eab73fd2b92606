"""Names that other books, libraries and habits have for what is named here; errors suggest ours by meaning.

Similar letters find a slip of the keyboard. They do not find `JointTask` for "nullspace", or "panda_hand" for
"end_effector".
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path

_ROOT = Path(__file__).parent
SYNONYMS: tuple[tuple[str, str], ...] = (  # what is said, and the names here; the likeliest stands first
    ("end effector, effector, eef, ee, tcp, tool, tool0, hand, gripper, tip, flange", "FrameTask"),
    ("ik, inverse kinematics, solve ik, compute ik, differential ik, ik solver", "solve_pose Controller"),
    ("fk, forward kinematics, frame placement", "Configuration"),
    ("nullspace, null space, posture, rest posture, regularization, regularisation", "JointTask"),
    ("com, cog, center of mass, centre of mass, center of gravity", "CentreOfMassTask SupportPolygonLimit"),
    ("zmp, support polygon, balance", "SupportPolygonLimit SupportPolygonTask"),
    ("velocity limit, speed limit, max velocity, max speed", "JointVelocityLimit FrameVelocityLimit"),
    ("position limit, configuration limit, joint limit, joint limits", "JointPositionLimit"),
    ("acceleration limit, max acceleration, jerk limit", "JointAccelerationLimit"),
    ("collision, self collision, collision avoidance", "SelfCollisionLimit ObstacleLimit"),
    ("body spherical, spherical barrier, distance between frames", "FrameDistanceLimit"),
    ("position barrier, workspace, workspace limit, box constraint", "BoxTask FrameDistanceLimit"),
    ("pinv, pseudo inverse, pseudoinverse, moore penrose, resolved rate", "PseudoInverse pinv"),
    ("dls, damped least squares, damped pseudo inverse, levenberg marquardt", "DampedLeastSquares dls"),
    ("lm damping, singularity robust, level damping", "DampedTask LevelDamping DampedLeastSquares"),
    ("jacobian transpose, transposed jacobian", "Transpose transpose"),
    ("jacobian, compute jacobian, frame jacobian", "geometric_jacobian analytical_jacobian"),
    ("saturation, esns, task scaling, velocity saturation", "sns"),
    ("singularity robust task priority, chiaverini", "srtp"),
    ("weighted, qp, weighted qp, soft priorities", "WeightedQP wqp/proxqp"),
    ("hierarchical, hierarchical qp, lexicographic, strict priorities", "HierarchicalQP hqp/daqp active-set"),
    ("sot, stack of tasks, task stack, problem", "Stack Hierarchy"),
    ("batch, batched, vectorised, vectorized, parallel, many robots, vmap, gpu", "BatchController"),
    ("point at, camera, visual servoing, gaze", "LookAtTask GazeTask"),
    ("relative, bimanual, dual arm", "RelativeFrameTask"),
    ("weld, connect, equality constraint, closed chain, loop closure", "LoopTask JointCouplingTask"),
    ("mimic, mimic joint, gear, transmission ratio", "JointCouplingTask Coupling"),
    ("wheel, no slip, nonholonomic", "RollingTask OmniwheelTask"),
    ("kinetic energy, energy, kinetic energy regularization", "KineticEnergyTask"),
    ("freeze, dof freezing, joint freezing", "JointVelocityTask Robot"),
    ("trajectory, reference, reference trajectory, setpoint", "Target Line Function Latest"),
    ("solve, qp solve, solve qp", "resolve Controller solve_pose"),
    ("simulate, rollout, play", "run Controller"),
    ("urdf, mjcf, xacro, robot model, robot wrapper, load robot, load model", "Robot"),
    ("kkt, proof, verify, optimality", "certify Certificate"),
    ("home, start, initial, nominal, ready, rest, zero, standing", "default half_sitting neutral middle"),
    ("franka, emika, fr3", "panda"),
    ("universal robots, universal robot", "ur5_robot ur10_robot ur3_robot"),
    ("unitree", "go2 g1_29dof_rev_1_0 z1"),
    ("kp, stiffness, lambda", "gain"),
    ("cost, importance, priority", "weight"),
    ("goal, desired, setpoint, reference", "target"),
    ("active, on, off, disabled", "enabled"),
    ("stop, halt", "brake"),
    ("slack, soften, relaxation", "relax"),
)  # fmt: skip
_SLIP = 0.85  # likeness of letters from which a name is taken for a slip, whatever it means


def near_names(name: str, known: Iterable[str], likeness: float) -> list[str]:
    """Suggest what may have been meant by a name: slips first, then meaning, then similar letters.

    Args:
        name: The unknown name.
        known: All names that there are.
        likeness: Share of equal letters from which a name is similar, 0 to 1, if there is nothing better.

    Returns:
        At most three of the known names.
    """
    known = tuple(known)
    return (
        get_close_matches(name, known, n=3, cutoff=_SLIP)
        or by_meaning(name, known)
        or get_close_matches(name, known, n=3, cutoff=likeness)
    )


def by_meaning(name: str, known: Iterable[str]) -> list[str]:
    """Suggest names for what somebody else calls otherwise.

    A row of the table applies if one of its phrases is among the words of the name; of several rows those
    with the longest phrase. It suggests its names, and known names that hold one of its phrases or names,
    such as "panda_hand" for "end_effector". Of an address, such as "hand.kp", the last part counts.

    Args:
        name: The unknown name, in any spelling: EndEffectorTask, end_effector, "end effector".
        known: All names that there are.

    Returns:
        At most three of the known names; none if the table does not have the name.
    """
    known = tuple(known)
    rows = sorted(_matches(_words(name.rpartition(".")[2])), key=lambda row: -row[0])
    rows = [row for row in rows if row[0] == rows[0][0]]
    found = [ours for _, _, names in rows for ours in names.split() if ours in known]
    said = [word for _, phrases, names in rows for word in (*phrases, *names.split())]
    alike = [other for other in known if any(_holds(_words(other), phrase) for phrase in said)]
    words = {*_words(name).split(), *(word for phrase in said for word in phrase.split())}
    alike.sort(key=lambda other: (len(set(_words(other).split()) - words), len(other)))
    return list(dict.fromkeys([*found, *alike]))[:3]


def _matches(words: str) -> Iterator[tuple[int, list[str], str]]:
    """Return length of the longest matching phrase, phrases and names of each row that applies."""
    for said, names in SYNONYMS:
        phrases = said.split(", ")
        length = max((len(phrase) for phrase in phrases if _holds(words, phrase)), default=0)
        if length:
            yield length, phrases, names


def _holds(words: str, phrase: str) -> bool:
    """Return True if a phrase stands among the words, or is all of them written as one."""
    return f" {phrase} " in f" {words} " or words.replace(" ", "") == phrase.replace(" ", "")


def _words(name: str) -> str:
    """Return the words of a name in lower case, separated by spaces."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|[^A-Za-z0-9]+", " ", name).lower().strip()


def way_out(name: str, known: Sequence[str]) -> str:
    """Advise on a name that the package does not have: a similar name, or the module that defines it.

    Args:
        name: The name.
        known: The names that there are.

    Returns:
        The advice, without a full stop.
    """
    if is_module(name):
        return f"it is a module: import taskopt.{name}"
    near = [other for other in known if len(name) > 3 and name.lower() in other.lower()]
    near = near or near_names(name, known, 0.7)
    if near:
        return f"did you mean {' or '.join(near[:3])}?"
    if modules := modules_that_define(name):
        return f"it lives in {' and '.join(modules)}"
    return "dir(taskopt) lists the names that there are"


def modules_that_define(name: str) -> list[str]:
    """Find modules that define a name, in their sources, since importing all of them would take seconds.

    Args:
        name: The name.

    Returns:
        Their names, in alphabetical order.
    """
    heads = tuple(f"{word}{name}{end}" for word in ("class ", "def ") for end in "(:[") + (f"{name} = ",)
    files = sorted(_ROOT.rglob("*.py"))
    found = [file for file in files if any(s.startswith(heads) for s in file.read_text("utf-8").splitlines())]
    paths = [file.parent if file.stem == "__init__" else file.with_suffix("") for file in found]
    return [".".join(["taskopt", *path.relative_to(_ROOT).parts]) for path in paths]


def is_module(name: str) -> bool:
    """Find out if a name is that of a module or a package of taskopt.

    Args:
        name: The name.

    Returns:
        True if it is.
    """
    path = _ROOT / name
    return path.is_dir() or path.with_suffix(".py").is_file()
