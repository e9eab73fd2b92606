"""Pictures of recordings: every layout of the Panda, the overview of every scenario, on a contact sheet.

Usage:
    python benchmarks/pictures.py [NAME ...] [--out docs/pictures/contact_sheet.jpg] [--folder FOLDER]

Each scenario of tasks/, or only the named ones, is run into a raw log; a recording is derived from it, and
Rerun's viewer draws it without a display, at the middle of the longest stretch of its most important limit.
With --folder pictures are kept one by one, too. It takes some ten minutes, and Pillow of taskopt[figures].
"""

import argparse
import io
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image, ImageDraw, ImageFont

from taskopt import Log, open_log, run
from taskopt.errors import InvalidValue, TaskoptError
from taskopt.loop.run_log import RunLog
from taskopt.loop.scenario import load_scenario, scenario_files
from taskopt.recording.derived.answers import Answers
from taskopt.recording.derived.lanes import lanes
from taskopt.recording.viewer.picture import drawn, headless
from taskopt.recording.viewer.review.layouts import LAYOUTS
from taskopt.recording.viewer.review.recording import record_logs
from taskopt.resolver.registry import resolver

ROOT = Path(__file__).parents[1]
SHOWN = "panda_circle"  # the scenario that is shown in every layout
RESOLVERS = ("active-set", "pinv")
COLUMNS, THUMB, CAPTION = 4, (480, 270), 22  # of the sheet [pixels]
MOST = 600_000  # bytes of the sheet


def main() -> None:
    """Draw the sheet, and keep its pictures if asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures" / "contact_sheet.jpg")
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    files = [f for f in scenario_files(ROOT / "tasks") if not asked.names or f.stem in asked.names]
    pictures = []
    with TemporaryDirectory() as work, headless() as viewer:
        for caption, recording, at in recordings(files, Path(work)):
            image = drawn(viewer, recording, at)
            pictures.append((f"{caption}, {at:.2f} s", image))
            print(pictures[-1][0], flush=True)
            if asked.folder is not None:
                (asked.folder / f"{caption.replace(' ', '_')}.png").write_bytes(image)
    save(sheet(pictures), asked.out)
    print(f"wrote {asked.out}, {asked.out.stat().st_size} bytes")


def recordings(files: list[Path], work: Path) -> Iterator[tuple[str, Path, float]]:
    """Yield caption, recording and moment of each picture; a scenario that has no log is named."""
    for file in files:
        try:
            log = logged(file, RESOLVERS[:1], work / f"{file.stem}.arrow")
        except InvalidValue as error:
            print(f"{file.stem} has no picture: {error}", flush=True)
            continue
        layouts = [name for name in LAYOUTS if name != "comparison"] if file.stem == SHOWN else ["overview"]
        for layout in layouts:
            yield f"{file.stem} {layout}", record_logs([log], layout, work / "run.rrd"), moment(log)
        if file.stem == SHOWN:
            both = logged(file, RESOLVERS, work / "both.arrow")
            recording = record_logs([both], "comparison", work / "run.rrd")
            yield f"{file.stem} comparison", recording, moment(both)


def logged(file: Path, names: tuple[str, ...], path: Path) -> Log:
    """Run a scenario into a log; one that ends in an error has a log up to there."""
    scenario = load_scenario(file)
    with RunLog(scenario, [resolver(name) for name in names], path, file) as log:
        for name in names:
            with suppress(TaskoptError):
                for _ in run(scenario, name, judged=1, log=log):
                    pass
    return open_log(path)


def moment(log: Log) -> float:
    """Return the middle of the longest stretch of the first lane; without one the middle of the log [s]."""
    answers = Answers(log, log.resolvers[0])
    found = lanes(answers)
    if not found:
        return 0.5 * float(answers.t[-1])
    longest = max(found[0].stretches, key=lambda stretch: stretch.last - stretch.first)
    return float(answers.t[(longest.first + longest.last) // 2])


def sheet(pictures: list[tuple[str, bytes]]) -> Image.Image:
    """Arrange pictures with their captions in rows."""
    width, height = THUMB[0], THUMB[1] + CAPTION
    rows = -(-len(pictures) // COLUMNS)
    out = Image.new("RGB", (COLUMNS * width, rows * height), "white")
    draw, font = ImageDraw.Draw(out), ImageFont.load_default(16)
    for number, (caption, image) in enumerate(pictures):
        x, y = width * (number % COLUMNS), height * (number // COLUMNS)
        small = Image.open(io.BytesIO(image)).convert("RGB").resize(THUMB, Image.Resampling.LANCZOS)
        out.paste(small, (x, y))
        draw.text((x + 6, y + THUMB[1] + 2), caption, fill="black", font=font)
    return out


def save(image: Image.Image, path: Path) -> None:
    """Save a picture in the best quality that stays below the size that a clone should bear."""
    for quality in range(90, 20, -5):
        image.save(path, quality=quality, optimize=True)
        if path.stat().st_size < MOST:
            return


if __name__ == "__main__":
    main()
