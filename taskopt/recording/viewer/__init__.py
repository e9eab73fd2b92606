"""The viewer of recordings, the only package that imports Rerun.

`sink` writes a run as a recording, by means of `writer`. The recording shows the `scene` (robots and paths,
`obstacles`, `regions`, `ellipsoids`), the distances (`clearance`), vectors over time (`plots`), the
`active_timeline`, the log of `events` and the `summary_panel`. `blueprint` lays them out, `paths` defines
their entity paths in the recording, and `palette` has all colours. `open` starts the viewer, and `picture`
draws a recording on a machine without a display.
"""
