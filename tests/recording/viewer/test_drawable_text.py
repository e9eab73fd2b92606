"""Text that the viewer can draw."""

from pathlib import Path

import pytest

from taskopt.loop.scenario import load_scenario
from taskopt.recording.viewer.drawable_text import drawable


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        ("½ q̇ᵀW q̇", "½ q̇TW q̇"),
        ("k₀ ∇w, ‖p − o‖ ≤ 2 √ε", "k₀ grad w, ‖p − o‖ ≤ 2 √ε"),
        ("J⁻¹", "J⁻¹"),
        ("手", "?"),
        ("plain\ntext | table", "plain\ntext | table"),
    ],
)
def test_what_the_font_lacks_is_put_in_plainer_letters(text, drawn):
    """One such character in a scenario's text would end the viewer."""
    assert drawable(text) == drawn


def test_every_shipped_scenario_is_drawable():
    """After `drawable`, nothing is left for it to do."""
    for path in sorted(Path("tasks").glob("*.py")):
        text = drawable(load_scenario(path).description)
        assert drawable(text) == text
        assert "?" not in text, path
