"""The layout that a recording opens with: scene and card on the left, plots on one time axis on the right."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from taskopt.record.recorder import RunInfo
from taskopt.record.viewer.active_timeline import EVENTS
from taskopt.record.viewer.arrangement import Place
from taskopt.record.viewer.clearance import least_line, margin_line, pair_line
from taskopt.record.viewer.palette import part, slug
from taskopt.record.viewer.plots import UNITS, compared, limit_rows, objective_terms, of, rows_in
from taskopt.record.viewer.summary_panel import CARD
from taskopt.record.viewer.writer import TIME
from taskopt.record.violation import LimitGauge

if TYPE_CHECKING:
    from rerun.blueprint import Blueprint

_TELLING = ("hqp/", "active-set")


def blueprint(info: RunInfo, place: Place, gauge: LimitGauge) -> "Blueprint":
    """A finished layout for one resolver or several: nothing is left for the viewer to guess."""
    import rerun.blueprint as rrb

    plots = list(_plots(info, gauge))
    left = rrb.Vertical(_scene(info, place), _texts(), row_shares=[1.9, 1.0])
    right = rrb.Vertical(*(view for view, _ in plots), row_shares=[share for _, share in plots])
    time = rrb.TimePanel(state="collapsed", timeline=TIME, play_state="paused")
    panels = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden"), time
    return rrb.Blueprint(rrb.Horizontal(left, right, column_shares=[1.0, 1.1]), *panels, auto_views=False)


def _plots(info: RunInfo, gauge: LimitGauge) -> Iterator[tuple[Any, float]]:
    """Views from top to bottom with their shares of the height, without those that would be empty."""
    import rerun.blueprint as rrb

    several = len(info.resolvers) > 1
    errors, objectives = _errors(info), _objectives(info)
    yield rrb.Tabs(*errors, *(objectives if several else []), name="Errors"), 1.2
    if objectives and not several:
        yield rrb.Tabs(*objectives, name="Objectives"), 0.8
    if several and gauge.keeps_positions:
        yield _plot("Beyond the position limits [rad]", [of(name, "beyond") for name in info.resolvers]), 0.9
    if gauge.moving.any():
        yield _each(info, "Position in its range", "q_normalised", "/scale/range"), 1.0
    if gauge.fast.any():
        yield _each(info, "Velocity in its limits", "v_normalised", "/scale/range"), 1.1
    else:
        yield _each(info, "Joint velocity [rad/s]", "v"), 1.1
    if info.plan.distance_limits:
        yield rrb.Tabs(*_distances(info), name="Distances"), 1.4
    if info.scenario.stack.limits or (limit_rows(info)[info.plan.layout.n :]).any():
        yield _each(info, "Multipliers", "multiplier"), 1.0
        yield _lanes(info), 2.1 if info.plan.distance_limits else 1.6
    yield rrb.Tabs(*_proofs(info), name="Proof"), 0.8
    yield _plot("Solve time [µs]", [of(name, "timing") for name in info.resolvers]), 0.8


def _scene(info: RunInfo, place: Place) -> Any:
    """The 3D view; paths are shown from the start of the run up to the cursor."""
    import rerun.blueprint as rrb

    past = rrb.VisibleTimeRanges(
        timeline=TIME,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
    paths = [
        f"/world/{slug(name)}/task/{part(task.name)}/actual"
        for name in info.resolvers
        for task in info.plan.tasks
        if task.frame is not None and rows_in(task, "m").any()
    ]
    position, target, up = place.eye(len(info.resolvers))
    return rrb.Spatial3DView(
        name="Robot" if len(info.resolvers) == 1 else "Robots, one a resolver",
        origin="/world",
        overrides=dict.fromkeys(paths, past),
        eye_controls=rrb.EyeControls3D(position=position, look_target=target, eye_up=up),
        line_grid=rrb.LineGrid3D(visible=True, color=[60, 66, 78, 110]),
        background=[16, 18, 23],
    )


def _texts() -> Any:
    import rerun.blueprint as rrb

    card = rrb.TextDocumentView(name="Run card", origin=CARD)
    events = rrb.TextLogView(name="Events", origin=EVENTS)
    return rrb.Tabs(card, events, active_tab=0, name="About")


def _plot(name: str, paths: list[str], axis: Any = None) -> Any:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ {path}" for path in paths],
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=axis,
        plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.RightTop),
    )


def _distances(info: RunInfo) -> list[Any]:
    """A plot for each limit: its pairs by name, or the least distance of each of several resolvers."""
    import rerun.blueprint as rrb

    plots = []
    for limit, bound in info.plan.distance_limits.items():
        paths = [least_line(name, limit) for name in info.resolvers]
        pairs = [pair_line(info.resolvers[0], limit) + "/**"] if len(info.resolvers) == 1 else []
        name = f"Distance: {limit.replace('_', ' ')} [m]"
        axis = rrb.ScalarAxis(range=(-0.2 * bound.influence, 1.2 * bound.influence), zoom_lock=True)
        plots.append(_plot(name, [*paths, margin_line(limit), *pairs], axis))
    return plots


def _each(info: RunInfo, name: str, key: str, *more: str) -> Any:
    """One tab for each resolver."""
    import rerun.blueprint as rrb

    if len(info.resolvers) == 1:
        return _plot(name, [of(info.resolvers[0], key), *more])
    tabs = [_plot(f"{name}: {r}", [of(r, key), *more]) for r in info.resolvers]
    return rrb.Tabs(*tabs, active_tab=_shown(info), name=name)


def _lanes(info: RunInfo) -> Any:
    import rerun.blueprint as rrb

    def view(resolver: str, name: str) -> Any:
        link = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
        return rrb.StateTimelineView(name=name, origin=of(resolver, "active"), time_view=link)

    if len(info.resolvers) == 1:
        return view(info.resolvers[0], "What binds")
    tabs = [view(r, f"What binds: {r}") for r in info.resolvers]
    return rrb.Tabs(*tabs, active_tab=_shown(info), name="What binds")


def _shown(info: RunInfo) -> int:
    """The tab in front: the first strict resolver that knows limits, which tells most."""
    strict = [i for i, name in enumerate(info.resolvers) if name.startswith(_TELLING)]
    return strict[0] if strict else 0


def _errors(info: RunInfo) -> list[Any]:
    """A plot for each unit of the frame tasks."""
    words = {"m": "Task error [m]", "rad": "Task error [rad]"}
    tasks = [task for task in info.plan.tasks if task.frame is not None] or list(info.plan.tasks)
    plots = []
    for unit in UNITS:
        fitting = [task.name for task in tasks if rows_in(task, unit).any()]
        paths = [of(name, "task", task, unit) for name in info.resolvers for task in fitting]
        plots += [_plot(words[unit], paths)] if paths else []
    return plots


def _objectives(info: RunInfo) -> list[Any]:
    plots = []
    for term in objective_terms(info):
        paths = [of(name, "objective", term.task, term.name) for name in info.resolvers]
        plots.append(_plot(f"Objective: {term.name}", paths))
    return plots


def _proofs(info: RunInfo) -> list[Any]:
    certificate = _plot(
        "Proof, log10 of the worst KKT residual",
        [*(of(n, "certificate") for n in info.resolvers), "/scale/proof"],
    )
    distance = _plot(
        "Distance to the closed form, log10 [rad/s]", [compared(name) for name in info.resolvers]
    )
    return [certificate, distance]
