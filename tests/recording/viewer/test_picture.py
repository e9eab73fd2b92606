"""Pictures: what cannot be drawn is named, and what can be is."""

import io

import pytest

from taskopt.errors import BadLog, InvalidValue, MissingFile
from taskopt.recording.viewer.picture import NoGraphics, take_picture


def test_wrong_orders_are_refused_before_a_viewer_starts(folder, tmp_path):
    """No recording, a negative time, no folder for the picture: each one clear line."""
    with pytest.raises(MissingFile, match="no recording"):
        take_picture(tmp_path / "run.rrd", tmp_path / "out.png")
    with pytest.raises(InvalidValue, match="≥ 0 s"):
        take_picture(folder / "run.rrd", tmp_path / "out.png", -1.0)
    with pytest.raises(InvalidValue, match="there is no folder"):
        take_picture(folder / "run.rrd", tmp_path / "nowhere" / "out.png")


@pytest.mark.slow
def test_a_picture_shows_the_layout(folder, tmp_path):
    """A PNG of the full size with more than a background; another time gives another picture."""
    from PIL import Image

    try:
        one = take_picture(folder / "run.rrd", tmp_path / "one.png", 0.1)
    except NoGraphics as error:
        pytest.skip(str(error))
    other = take_picture(folder / "run.rrd", tmp_path / "other.png", 0.6)
    image = Image.open(io.BytesIO(one.read_bytes()))
    assert image.size == (1920, 1080)
    assert len(image.convert("RGB").getcolors(maxcolors=1 << 24)) > 500
    assert one.read_bytes() != other.read_bytes()


@pytest.mark.slow
def test_a_file_without_a_run_is_named(tmp_path):
    """A recording without steps ends in an error, not in a picture of nothing."""
    file = tmp_path / "run.rrd"
    file.write_bytes(b"not a recording")
    with pytest.raises((BadLog, NoGraphics)):
        take_picture(file, tmp_path / "out.png")
