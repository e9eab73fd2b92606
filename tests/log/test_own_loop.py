"""Loops of one's own, logged by `record`: with a resolver, with velocities only, and what is refused."""

import numpy as np
import pytest

from taskopt import (
    Controller,
    Hierarchy,
    Level,
    RestDamping,
    certify_velocity,
    find_conflict,
    open_log,
    record,
    solve_again,
)
from taskopt.errors import InvalidValue, UnknownName
from taskopt.log import story
from taskopt.log.claims import claims
from taskopt.resolver.registry import resolver
from tests.log.conftest import ARM, DT, START, stack


@pytest.mark.parametrize("name", ["active-set", "hqp/daqp"])
def test_a_loop_that_calls_a_resolver_is_logged_and_solved_again(tmp_path, name):
    """Postures, answers and memory are in the file, and each tick gives its answer to the last bit."""
    plan, own, q, memory, sent = stack().compile(ARM, DT), resolver(name), START, None, []
    with record(tmp_path / "a.arrow", dt=DT, resolver=own, robot=ARM, facts={"who": "a test"}) as log:
        for k in range(40):
            hierarchy, before = plan.at(q, k * DT), memory
            resolution, memory = own(hierarchy, before)
            log.add(resolution, k * DT, q, memory=before)
            sent.append((q, resolution))
            plan.answered(resolution.x)
            q = ARM.integrate(q, resolution.x, DT)
        assert log.count == 40
    read = open_log(tmp_path / "a.arrow")
    assert (read.end.end, read.resolvers, read.facts["who"]) == ("finished", (name,), "a test")
    assert read.names("q") == ("joint1", "joint2", "joint3")
    assert read.facts["robot"]["position_upper"] == [3.0, 3.0, 3.0]
    for k, (posture, answer) in enumerate(sent):
        tick = read.tick(k)
        assert np.array_equal(tick.values["q"], posture)
        assert np.array_equal(tick.resolution.answer, answer.answer)
        assert solve_again(tick).distance == 0.0


def test_velocities_alone_get_prices_and_are_judged(tmp_path):
    """What somebody else sent is the answer of the log: with its multipliers, its violations, its proof."""
    level = Level([[1.0, 1.0]], [3.0], name="sum")
    problem = Hierarchy([level], box=([-1.0, -1.0], [1.0, 1.0]))
    with record(tmp_path / "a.arrow", dt=0.1, resolver="firmware") as log:
        for k, x in enumerate([(1.0, 1.0), (0.5, 0.5), (1.5, 1.5)]):
            log.add(x, 0.1 * k, hierarchy=problem)
    read = open_log(tmp_path / "a.arrow")
    assert "q" not in read.columns
    at_limit, inside, outside = (read.tick(k).resolution for k in range(3))
    expected = certify_velocity(problem, [1.0, 1.0])
    assert expected.kkt_met()
    assert at_limit.kkt_met()
    assert [abs(row.multiplier) for row in at_limit.active] == pytest.approx([1.0, 1.0])  # 3 − 1 − 1
    assert at_limit.proven
    assert not inside.proven
    assert outside.active
    found = {claim.name: claim.rows.tolist() for claim in claims(read, prove=True)}
    assert found["violation"] == [2]
    assert found["unproven"] == [1, 2]
    assert solve_again(read.tick(1), "active-set").resolution.x == pytest.approx([1.0, 1.0])
    with pytest.raises(UnknownName, match="firmware"):
        solve_again(read.tick(1))


def test_steps_of_a_controller_are_logged_as_they_were_sent(tmp_path):
    """A controller in a loop of one's own: damped ticks have the velocity that was sent, and say so."""
    declared = stack((2.0, 0.3, 0.0), damping=RestDamping(), acceleration=None)
    control, q, sent = Controller(ARM, declared, dt=DT), START, []
    with record(tmp_path / "a.arrow", dt=DT, resolver="mine") as log:
        for k in range(500):
            answer = control.step(q, k * DT)
            log.add(answer, k * DT, q)
            sent.append(answer)
            q = ARM.integrate(q, answer.v, DT)
    read = open_log(tmp_path / "a.arrow")
    assert np.array_equal(read.array("x"), [answer.x for answer in sent])
    damped = [k for k, answer in enumerate(sent) if answer.undamped is not None]
    assert damped
    assert [k for k, notes in enumerate(read.array("notes")) if notes] == damped
    assert np.array_equal(read.tick(damped[0]).hierarchy.buffer, sent[damped[0]].undamped.problem.buffer)


def failing(path, problem):
    """Log one tick, then one that failed, and raise its error."""
    with record(path, dt=0.1, resolver="active-set") as log:
        answer, _ = resolver("active-set")(problem)
        log.add(np.zeros(1), 0.0, hierarchy=problem)
        log.add(answer, 0.1, error="the limits exclude each other")
        raise RuntimeError("stopped by a test")


def test_an_error_that_ends_a_loop_is_in_its_log(tmp_path):
    """The tick that failed has its hierarchy and its reason, and the log says what ended the loop."""
    limits = Level([[1.0]], [2.0], name="limit")
    problem = Hierarchy([Level([[1.0]], [0.0])], box=([-1.0], [1.0]), limits=limits)
    with pytest.raises(RuntimeError):
        failing(tmp_path / "a.arrow", problem)
    read = open_log(tmp_path / "a.arrow")
    assert (read.end.end, read.end.why) == ("interrupted", "stopped by a test")
    assert find_conflict(read.tick(1).hierarchy) is not None
    assert "raised an error at t = 0.1 s: the limits exclude each other" in story.why(read)


def test_what_does_not_fit_is_refused_by_name(tmp_path):
    """Another ending, no folder, no hierarchy, other sizes and other names each have one clear error."""
    one, other = (Hierarchy([Level([[1.0] * n], [1.0])]) for n in (1, 2))
    for place, match in ((tmp_path / "a.txt", r"must end in \.arrow"), ("/no/such/a.arrow", "no folder")):
        with pytest.raises(InvalidValue, match=match):
            record(place, dt=0.1)
    with pytest.raises(InvalidValue, match=r"must end in \.arrow"):
        Controller(ARM, stack(), dt=DT, log=tmp_path / "a.txt")
    with record(tmp_path / "a.arrow", dt=0.1) as log:
        with pytest.raises(InvalidValue, match="hierarchy="):
            log.add([1.0], 0.0)
        with pytest.raises(InvalidValue, match="1 numbers"):
            log.add([1.0, 2.0], 0.0, hierarchy=one)
        log.add([1.0], 0.0, [0.5], hierarchy=one)
        with pytest.raises(InvalidValue, match="those of the first tick"):
            log.add([1.0, 2.0], 0.0, [0.5], hierarchy=other)
        with pytest.raises(InvalidValue, match="q must have 1 numbers"):
            log.add([1.0], 0.0, hierarchy=one)
    assert len(open_log(tmp_path / "a.arrow")) == 1
