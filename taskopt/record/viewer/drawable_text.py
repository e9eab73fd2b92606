"""Text that the viewer can draw: it stops dead at a character that its font lacks (Rerun 0.41)."""

import unicodedata
from string import printable

_SYMBOLS = "–—‘’“”…•†‡−√∞∂∑∏∫≈≠≤≥←↑→↓⁰⁴⁵⁶⁷⁸⁹⁺⁻₀₁₂₃₄₅₆₇₈₉‖\u0307"  # the last: the dot above
_INSTEAD = {"∇": "grad "}


def drawable(text: str) -> str:
    """The text with every character that the viewer's font may lack put in plainer letters, or as "?"."""
    return "".join(character if _safe(character) else _plain(character) for character in text)


def _safe(character: str) -> bool:
    """ASCII, Latin, Greek and the symbols that stand in the font."""
    return (
        character in printable
        or character in _SYMBOLS
        or "\u00a0" <= character <= "\u017f"
        or _greek(character)
    )


def _greek(character: str) -> bool:
    return "\u0391" <= character <= "\u03a9" or "\u03b1" <= character <= "\u03c9"


def _plain(character: str) -> str:
    """The nearest of what is safe: ᵀ becomes T, a combining dot vanishes."""
    if character in _INSTEAD:
        return _INSTEAD[character]
    if unicodedata.combining(character):
        return ""
    letters = unicodedata.normalize("NFKD", character)
    return "".join(letter for letter in letters if _safe(letter)) or "?"
