"""The layouts of a review, each for one purpose."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from taskopt.recording.viewer.arrangement import Camera
from taskopt.recording.viewer.blueprint import View, complete_layout, plot_view, scene_view, time_axis
from taskopt.recording.viewer.paths import EVENTS, RANGE, SUMMARY
from taskopt.recording.viewer.review.series import Plotted
from taskopt.recording.viewer.writer import TIME

_LANES = 9  # lanes of an arm beside plots; the layout of limits has all
_NAMED = 4  # lines that the legend of a plot of usual height can name
_ABOVE = 2.0  # top of the plot of solve times, as a multiple of their 95th percentile


@dataclass(frozen=True, eq=False)
class ArmPlots:
    """What was sent of one arm, for the layouts to choose from.

    Attributes:
        name: Name of the arm.
        lanes: Paths of its lanes.
        microseconds: The 95th percentile of its solve times [µs].
        plots: Its plots by kind: "errors", "shares", "velocities", "prices", "singular", "looks", "solver",
            "apart".
    """

    name: str
    lanes: list[str]
    microseconds: float
    plots: dict[str, list[Plotted]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Stage:
    """All that a layout can show.

    Attributes:
        arms: What was sent of each arm.
        camera: The camera.
        trails: Paths that are shown from the start up to the cursor.
        end: Time at which the last tick ends [s].
    """

    arms: Sequence[ArmPlots]
    camera: Camera
    trails: Sequence[str]
    end: float

    @property
    def scene(self) -> View:
        """The robots."""
        return scene_view("Robot" if len(self.arms) == 1 else "Robots", self.camera, self.trails)

    @property
    def texts(self) -> View:
        """Summary and events, side by side."""
        summary = rrb.TextDocumentView(name="Summary", origin=SUMMARY)
        return rrb.Horizontal(summary, self.events, column_shares=[0.8, 1.0])

    @property
    def events(self) -> View:
        """The events of all arms."""
        columns = rrb.TextLogColumns(
            timeline_columns=[TimelineColumn(TIME)],
            text_log_columns=[TextLogColumn(kind=kind) for kind in ("LogLevel", "Body")],
        )
        return rrb.TextLogView(name="Events", origin=EVENTS, columns=columns)

    def plots(self, kind: str, *, tall: bool = False) -> list[View]:
        """Lay out the plots of a kind, those of all arms with one title in one view.

        Args:
            kind: Their kind.
            tall: True if they are tall enough for a long legend.

        Returns:
            The views, in the order in which they were sent.
        """
        paths: dict[str, list[str]] = {}
        lines: dict[str, int] = {}
        for arm in self.arms:
            for plotted in arm.plots.get(kind, ()):
                paths.setdefault(plotted.title, []).append(plotted.path)
                lines[plotted.title] = lines.get(plotted.title, 0) + plotted.lines
        return [
            plot_view(title, own, self._axis(title), self.end, legend=tall or lines[title] <= _NAMED)
            for title, own in paths.items()
        ]

    def each(self, kind: str, place: int | None = None, *, tall: bool = False) -> View | None:
        """Lay out the plots of a kind with a tab for each arm.

        Args:
            kind: Their kind.
            place: Only the plot at this place; None for all.
            tall: True if they are tall enough for a long legend.

        Returns:
            The view; None if there is nothing to show.
        """
        tabs: list[View] = []
        front = 0
        for arm in self.arms:
            own = arm.plots.get(kind, [])
            front = len(tabs) if arm is self.front else front
            for plotted in own if place is None else own[place : place + 1]:
                title = plotted.title if len(self.arms) == 1 else f"{plotted.title}: {arm.name}"
                paths = [plotted.path, *([RANGE] if kind == "shares" and not tall else [])]
                legend = tall or plotted.lines <= _NAMED
                tabs.append(plot_view(title, paths, self._axis(title), self.end, legend=legend))
        if not tabs:
            return None
        return tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs, active_tab=front)

    def lanes(self, most: int | None = None) -> View:
        """Lay out the lanes with a tab for each arm.

        Args:
            most: Only so many lanes, the most important ones.

        Returns:
            The view.
        """
        tabs = []
        for arm in self.arms:
            shown = arm.lanes if most is None else arm.lanes[:most]
            left = f", {len(shown)} of {len(arm.lanes)}" if len(shown) < len(arm.lanes) else ""
            title = "Limits over time" if len(self.arms) == 1 else f"Limits over time: {arm.name}"
            contents = [f"+ {path}" for path in shown]
            axis = time_axis(self.end)
            tabs.append(
                rrb.StateTimelineView(name=title + left, origin="/", contents=contents, time_view=axis)
            )
        return tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs, active_tab=self.arms.index(self.front))

    @property
    def share_of_lanes(self) -> float:
        """The height of some lanes, where 1 is that of a plot."""
        return 0.4 + 0.22 * min(_LANES, max(len(arm.lanes) for arm in self.arms))

    @property
    def front(self) -> ArmPlots:
        """The arm whose tab is in front: the first one."""
        return self.arms[0]

    def _axis(self, title: str) -> rrb.ScalarAxis | None:
        """Return the axis of a plot whose range is not what fits."""
        if title.startswith("Solve time"):
            most = _ABOVE * max(arm.microseconds for arm in self.arms)
            return rrb.ScalarAxis(range=(0.0, most), zoom_lock=True)
        if title.startswith(("Position in", "Velocity in")):
            return rrb.ScalarAxis(range=(-1.1, 1.1))
        return None


def _overview(stage: Stage) -> rrb.Blueprint:
    """Lay out a bit of everything."""
    shown = [
        (_tabs([*stage.plots("errors"), *stage.plots("singular")]), 1.2),
        (stage.each("shares", 0), 1.0),
        (stage.each("shares", 1) or stage.each("velocities"), 1.0),
        (stage.lanes(_LANES), stage.share_of_lanes),
        (stage.each("prices"), 1.0),
        (_tabs(stage.plots("solver")), 0.8),
    ]
    return _beside_the_scene(stage, shown)


def _limits(stage: Stage) -> rrb.Blueprint:
    """Lay out what limits did and what they cost, with legends of all joints."""
    shares = [(stage.each("shares", place, tall=True), 1.0) for place in (0, 1)]
    prices = [(view, 1.0) for view in stage.plots("prices", tall=True)]
    left = _stacked([(stage.scene, 1.3), *shares])
    right = _stacked([(stage.lanes(), 2.2), *prices, (stage.events, 0.8)])
    return complete_layout(rrb.Horizontal(left, right, column_shares=[1.0, 1.1]))


def _hierarchy(stage: Stage) -> rrb.Blueprint:
    """Lay out levels: errors, ranks, singular values, damping."""
    left = [(stage.scene, 1.4), *((view, 0.7) for view in stage.plots("looks"))]
    right = [(view, 1.0) for view in (*stage.plots("errors"), *stage.plots("singular", tall=True))]
    return complete_layout(rrb.Horizontal(_stacked(left), _stacked(right), column_shares=[1.0, 1.1]))


def _solver(stage: Stage) -> rrb.Blueprint:
    """Lay out how the answers were found: times, iterations, residuals, difference from the closed form."""
    shown = [(view, 1.0) for view in (*stage.plots("solver"), *stage.plots("proofs"))]
    return _beside_the_scene(stage, [*shown, (stage.lanes(_LANES), 1.6)])


def _comparison(stage: Stage) -> rrb.Blueprint:
    """Lay out arms side by side: errors in one plot, differences, and limits of each."""
    errors = stage.plots("errors")
    views = [(view, 1.0) for view in errors[:2]]
    views += [(view, 1.0) for view in stage.plots("apart")]
    views += [(stage.each("shares", 0), 0.9), (stage.each("shares", 1), 0.9), (stage.lanes(_LANES), 1.8)]
    return _beside_the_scene(stage, [*views, (_tabs(stage.plots("solver")), 0.7)])


def _figure(stage: Stage) -> rrb.Blueprint:
    """Lay out the robots alone."""
    return complete_layout(rrb.Horizontal(stage.scene))


LAYOUTS: dict[str, Callable[[Stage], rrb.Blueprint]] = {
    "overview": _overview,
    "limits": _limits,
    "hierarchy": _hierarchy,
    "solver": _solver,
    "comparison": _comparison,
    "figure": _figure,
}
"""The layouts, by name."""


def _beside_the_scene(stage: Stage, shown: Sequence[tuple[View | None, float]]) -> rrb.Blueprint:
    """Lay out scene and texts on the left, and views on the right."""
    left = _stacked([(stage.scene, 1.9), (stage.texts, 1.0)])
    return complete_layout(rrb.Horizontal(left, _stacked(shown), column_shares=[1.0, 1.1]))


def _stacked(shown: Sequence[tuple[View | None, float]]) -> View:
    """Stack those views that there are, with their shares of the height."""
    views = [(view, share) for view, share in shown if view is not None]
    return rrb.Vertical(*(view for view, _ in views), row_shares=[share for _, share in views])


def _tabs(views: Sequence[View]) -> View | None:
    """Put views behind each other; None for none."""
    if not views:
        return None
    return views[0] if len(views) == 1 else rrb.Tabs(*views, active_tab=0)
