"""Peers in other interpreters: what they are handed, what they answer, and one of one's own."""

import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from cases import benchmark_case
from peers import environments
from peers.handed import Remote, hand_over, hand_over_rows
from peers.sequences import lines
from peers.served import handed_case, handed_problems

from taskopt import Hierarchy, Level
from taskopt.errors import InvalidValue

OWN = """
import numpy as np
from served import serve

def stack(case):
    return f"own {case.hand}", lambda i: None

def rows(problems, solver):
    def answer(i):
        if i == 1:
            raise ValueError("none today")
        x, free = np.zeros(len(problems[i].box[0])), np.eye(len(problems[i].box[0]))
        for A, b in problems[i].levels:
            inverse = np.linalg.pinv(A @ free, rcond=1e-8)
            x, free = x + inverse @ (b - A @ x), free - inverse @ A @ free
        return x + OFF
    return f"own {solver}", answer

serve(stack, rows, ValueError)
"""


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """A peer of one's own that knows no limits, and refuses problem number 1."""
    (tmp_path / "own.py").write_text(OWN.replace("OFF", "0.0"))
    return tmp_path / "own.py"


def test_rows_are_handed_over_as_they_are() -> None:
    """Box and hard rows to the last bit, infinite ones too; rows of levels times the root of their weight."""
    limits = Level([[1.0, 2.0]], upper=[0.3])
    problem = Hierarchy([Level([[0.1, 0.2]], [0.7], weight=[4.0])], ([-1.0, -np.inf], [1.0, 2.0]), limits)
    (one,) = handed_problems(hand_over_rows([problem]))
    assert [side.tolist() for side in one.box] == [[-1.0, -np.inf], [1.0, 2.0]]
    assert [part.tolist() for part in one.hard] == [[[1.0, 2.0]], [-np.inf], [0.3]]
    assert [[part.tolist() for part in level] for level in one.levels] == [[[[0.2, 0.4]], [1.4]]]
    unequal = Hierarchy([Level([[1.0, 0.0]], lower=[0.0], upper=[1.0])])
    with pytest.raises(InvalidValue, match="inequalities"):
        hand_over_rows([unequal])


def test_a_peer_of_ones_own_takes_turns(script: Path) -> None:
    """It is timed at each problem and answers it, but for one that it refuses; a case is handed over, too."""
    problems = [Hierarchy([Level([[1.0, 1.0]], [float(k)])]) for k in range(3)]
    remote = Remote(sys.executable, str(script), hand_over_rows(problems), "x", "cpu")
    times = np.concatenate([remote.block(0, 2), remote.block(2, 3)])
    remote.close()
    assert remote.name == "own x"
    assert (times >= 0.0).all()
    assert remote.answers == [[0.0, 0.0], None, [pytest.approx(1.0), pytest.approx(1.0)]]
    case = benchmark_case("W1", 3)
    folder = hand_over(case)
    assert np.array_equal(handed_case(folder, "x").poses, np.array(case.poses))
    remote = Remote(sys.executable, str(script), folder, "x", "wall")
    assert remote.name == f"own {case.frame}"
    assert len(remote.block(0, 3)) == 3
    remote.close()


@pytest.mark.parametrize(("off", "least", "most"), [("0.0", 0.0, 1e-9), ("1e-3", 1e-4, 2e-3)])
def test_answers_are_judged_by_exact_optima(tmp_path: Path, off: str, least: float, most: float) -> None:
    """Where no limit binds, pseudo-inverses meet all levels; a planted lie is seen."""
    (tmp_path / "own.py").write_text(OWN.replace("OFF", off).replace("i == 1", "i == 100"))
    arguments = Namespace(
        peers=None, with_own=[(sys.executable, str(tmp_path / "own.py"))], clock="cpu", block=9
    )
    found = {one.name: one for one in lines("free", arguments)}
    assert list(found) == ["active-set", "wqp@0.001/daqp", "own own"]
    assert found["active-set"].distance < 1e-12
    assert found["wqp@0.001/daqp"].from_weighted == 0.0
    assert found["own own"].answered == found["active-set"].answered == 45
    assert least <= found["own own"].distance <= most


def test_only_what_is_installed_takes_part(tmp_path: Path) -> None:
    """An environment counts when all of its packages are in it."""
    assert environments.installed(tmp_path) == {}
    (tmp_path / "mink").mkdir()
    assert environments.installed(tmp_path) == {}
    (tmp_path / "mink" / "installed").touch()
    assert list(environments.installed(tmp_path)) == ["mink"]
    assert environments.install(tmp_path, "mink") == ""


@pytest.mark.slow
def test_a_peer_that_cannot_be_installed_is_named_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pip's own words; and the environment does not count."""
    gone = environments.Peer("x.py", ("x",), (str(tmp_path / "nowhere"),))
    monkeypatch.setitem(environments.PEERS, "gone", gone)
    assert environments.install(tmp_path, "gone").startswith("ERROR: ")
    assert "gone" not in environments.installed(tmp_path)
