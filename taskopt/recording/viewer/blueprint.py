"""The layout of a recording: scene and summary on the left, plots over time on the right."""

from collections.abc import Iterator, Sequence

import rerun.blueprint as rrb

from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.arrangement import Arrangement, Camera
from taskopt.recording.viewer.palette import BACKGROUND, GRID
from taskopt.recording.viewer.paths import (
    EVENTS,
    PROOF,
    RANGE,
    SUMMARY,
    all_pairs_path,
    closed_form_path,
    data_path,
    least_distance_path,
    margin_path,
    world_path,
)
from taskopt.recording.viewer.plots import UNITS
from taskopt.recording.viewer.rows import limit_rows, objective_terms, rows_in_unit
from taskopt.recording.viewer.writer import TIME
from taskopt.recording.violation import LimitGauge

View = rrb.View | rrb.Container
_STRICT = ("hqp/", "active-set")  # beginnings of the names of strict resolvers that know limits


def blueprint(info: RunInfo, arrangement: Arrangement, gauge: LimitGauge) -> rrb.Blueprint:
    """Lay out a recording completely, so that the viewer adds nothing of its own.

    Args:
        info: The facts about the run, of one resolver or several.
        arrangement: The arrangement of the scene.
        gauge: The limits of the run.

    Returns:
        The layout.
    """
    plots = list(_plots(info, gauge))
    left = rrb.Vertical(_scene(info, arrangement), _texts(), row_shares=[1.9, 1.0])
    right = rrb.Vertical(*(view for view, _ in plots), row_shares=[share for _, share in plots])
    return complete_layout(rrb.Horizontal(left, right, column_shares=[1.0, 1.1]))


def complete_layout(views: rrb.Container) -> rrb.Blueprint:
    """Lay out views alone, with no panel open and the time at rest, so that the viewer adds nothing.

    Args:
        views: All views.

    Returns:
        The layout.
    """
    time = rrb.TimePanel(state="collapsed", timeline=TIME, play_state="paused")
    hidden = (
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.TopPanel(state="hidden"),
    )
    panels = *hidden, time
    return rrb.Blueprint(views, *panels, auto_views=False)


def scene_view(name: str, camera: Camera, trails: Sequence[str] = ()) -> View:
    """Lay out the 3D view.

    Args:
        name: Its title.
        camera: Its camera.
        trails: Paths of entities that are shown from the start of the run up to the cursor.

    Returns:
        The view.
    """
    past = rrb.VisibleTimeRanges(
        timeline=TIME,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
    return rrb.Spatial3DView(
        name=name,
        origin="/world",
        overrides=dict.fromkeys(trails, past),
        eye_controls=rrb.EyeControls3D(
            position=camera.position, look_target=camera.look_target, eye_up=camera.up
        ),
        line_grid=rrb.LineGrid3D(visible=True, color=GRID),
        background=rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=BACKGROUND),
    )


def _plots(info: RunInfo, gauge: LimitGauge) -> Iterator[tuple[View, float]]:
    """Yield the views from top to bottom and their shares of the height; none of them is empty."""
    several = len(info.resolvers) > 1
    errors, objectives = _errors(info), _objectives(info)
    yield rrb.Tabs(*errors, *(objectives if several else []), name="Errors"), 1.2
    if objectives and not several:
        yield rrb.Tabs(*objectives, name="Objectives"), 0.8
    if several and gauge.keeps_positions:
        paths = [data_path(name, "position_violation") for name in info.resolvers]
        yield plot_view("Beyond the position limits [rad]", paths), 0.9
    if gauge.ranged.any():
        yield _one_tab_each(info, "Position in its range", "q_normalised", RANGE), 1.0
    if gauge.bounded.any():
        yield _one_tab_each(info, "Velocity in its limits", "v_normalised", RANGE), 1.1
    else:
        yield _one_tab_each(info, "Joint velocity [rad/s]", "v"), 1.1
    if info.accelerates and gauge.accelerations_bounded.any():
        yield _one_tab_each(info, "Acceleration in its limits", "a_normalised", RANGE), 1.1
    elif info.accelerates:
        yield _one_tab_each(info, "Joint acceleration [rad/s²]", "a"), 1.1
    if info.plan.distance_limits:
        yield rrb.Tabs(*_distances(info), name="Distances"), 1.4
    if info.scenario.stack.limits or (limit_rows(info)[info.plan.layout.n :]).any():
        yield _one_tab_each(info, "Multipliers (prices)", "multiplier"), 1.0
        yield _active_timelines(info), 2.1 if info.plan.distance_limits else 1.6
    yield rrb.Tabs(*_proofs(info), name="Proof"), 0.8
    yield plot_view("Solve time [µs]", [data_path(name, "timing") for name in info.resolvers]), 0.8


def _scene(info: RunInfo, arrangement: Arrangement) -> View:
    """Lay out the 3D view; actual paths and trails are shown from the start of the run up to the cursor."""
    paths = [
        world_path(name, "task", task.name, "actual")
        for name in info.resolvers
        for task in info.plan.tasks
        if task.frame is not None and rows_in_unit(task, "m").any()
    ]
    paths += [world_path(name, "trail", frame) for name in info.resolvers for frame in info.scenario.trails]
    name = "Robot" if len(info.resolvers) == 1 else "Robots, one a resolver"
    return scene_view(name, arrangement.camera(len(info.resolvers)), paths)


def _texts() -> View:
    """Lay out the summary panel, and the log of events behind it."""
    summary = rrb.TextDocumentView(name="Summary", origin=SUMMARY)
    events = rrb.TextLogView(name="Events", origin=EVENTS)
    return rrb.Tabs(summary, events, active_tab=0, name="About")


def plot_view(
    name: str,
    paths: Sequence[str],
    axis: rrb.ScalarAxis | None = None,
    end: float | None = None,
    *,
    legend: bool = True,
) -> View:
    """Plot some entities on the common time axis.

    Args:
        name: Its title.
        paths: The entities.
        axis: The axis of the numbers; default: what fits.
        end: The time at which the axis ends [s]; default: what the viewer chooses.
        legend: False for more lines than a legend of this height can name.

    Returns:
        The view.
    """
    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ {path}" for path in paths],
        axis_x=time_axis(end),
        axis_y=axis,
        plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
    )


def time_axis(end: float | None = None) -> rrb.TimeAxis:
    """Return the time axis that plots and lanes share.

    Args:
        end: Time at which it ends [s]; default: what the viewer chooses.

    Returns:
        The axis, which begins at 0 s.
    """
    link = rrb.components.LinkAxis.LinkToGlobal
    if end is None:
        return rrb.TimeAxis(link=link)
    start, stop = (rrb.TimeRangeBoundary.absolute(seconds=at) for at in (0.0, end))
    return rrb.TimeAxis(link=link, view_range=rrb.TimeRange(start=start, end=stop))


def _distances(info: RunInfo) -> list[View]:
    """Plot the pairs of each distance limit, or only the least distance if there are several resolvers."""
    plots = []
    for limit, bound in info.plan.distance_limits.items():
        paths = [least_distance_path(name, limit) for name in info.resolvers]
        pairs = [all_pairs_path(info.resolvers[0], limit)] if len(info.resolvers) == 1 else []
        axis = rrb.ScalarAxis(range=(-0.2 * bound.influence, 1.2 * bound.influence), zoom_lock=True)
        title = f"Distance: {limit.replace('_', ' ')} [m]"
        plots.append(plot_view(title, [*paths, margin_path(limit), *pairs], axis))
    return plots


def _one_tab_each(info: RunInfo, name: str, key: str, *more: str) -> View:
    """Plot one quantity, with a tab for each of several resolvers."""
    if len(info.resolvers) == 1:
        return plot_view(name, [data_path(info.resolvers[0], key), *more])
    tabs = [
        plot_view(f"{name}: {resolver}", [data_path(resolver, key), *more]) for resolver in info.resolvers
    ]
    return rrb.Tabs(*tabs, active_tab=_front_tab(info), name=name)


def _active_timelines(info: RunInfo) -> View:
    """Lay out the active-set timeline, with a tab for each of several resolvers."""

    def view(resolver: str, name: str) -> View:
        """Lay out the timeline of one resolver."""
        link = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
        return rrb.StateTimelineView(name=name, origin=data_path(resolver, "active"), time_view=link)

    if len(info.resolvers) == 1:
        return view(info.resolvers[0], "Active set")
    tabs = [view(resolver, f"Active set: {resolver}") for resolver in info.resolvers]
    return rrb.Tabs(*tabs, active_tab=_front_tab(info), name="Active set")


def _front_tab(info: RunInfo) -> int:
    """Choose the tab in front, which is that of the first strict resolver that considers limits."""
    strict = [i for i, name in enumerate(info.resolvers) if name.startswith(_STRICT)]
    return strict[0] if strict else 0


def _errors(info: RunInfo) -> list[View]:
    """Plot the errors of the frame tasks, or of all tasks if none has a frame, one plot for each unit."""
    tasks = [task for task in info.plan.tasks if task.frame is not None] or list(info.declared)
    plots = []
    for unit in UNITS:
        fitting = [task.name for task in tasks if rows_in_unit(task, unit).any()]
        paths = [data_path(name, "task", task, unit) for name in info.resolvers for task in fitting]
        plots += [plot_view(f"Task error [{unit}]", paths)] if paths else []
    return plots


def _objectives(info: RunInfo) -> list[View]:
    """Plot each term of the objectives."""
    plots = []
    for term in objective_terms(info):
        paths = [data_path(name, "objective", term.task, term.name) for name in info.resolvers]
        plots.append(plot_view(f"Objective: {term.name}", paths))
    return plots


def _proofs(info: RunInfo) -> list[View]:
    """Plot the error bounds, the KKT residuals, and the distances to the closed-form answers."""
    bounds = [*(data_path(name, "error_bound") for name in info.resolvers), PROOF]
    residuals = [data_path(name, "kkt_residual") for name in info.resolvers]
    distances = [closed_form_path(name) for name in info.resolvers]
    return [
        plot_view("Proof, log10 of the error bound over max(1, |x|)", bounds),
        plot_view("KKT residual, log10 of the largest", residuals),
        plot_view(f"Distance to the closed form, log10 [{info.plan.layout.angular_unit}]", distances),
    ]
