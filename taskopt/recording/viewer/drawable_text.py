"""Text that the viewer can draw, since Rerun 0.41 cuts a text at a character that its font lacks."""

import unicodedata
from string import printable

_COMBINING_DOT = "\u0307"  # above a letter, as in q̇
_SYMBOLS = "–—‘’“”…•†‡−√∞∂∑∏∫≈≠≤≥←↑→↓⁰⁴⁵⁶⁷⁸⁹⁺⁻₀₁₂₃₄₅₆₇₈₉‖" + _COMBINING_DOT
_REPLACEMENTS = {"∇": "grad "}


def drawable(text: str) -> str:
    """Replace every character that the viewer's font may lack.

    Args:
        text: Any text.

    Returns:
        The text, in which plainer letters or "?" replace such characters.
    """
    return "".join(character if _is_drawable(character) else _plainer(character) for character in text)


def _is_drawable(character: str) -> bool:
    """Return True for ASCII, Latin and Greek letters and the symbols that the font has."""
    return (
        character in printable
        or character in _SYMBOLS
        or "\u00a0" <= character <= "\u017f"
        or "\u0391" <= character <= "\u03a9"
        or "\u03b1" <= character <= "\u03c9"
    )


def _plainer(character: str) -> str:
    """Return the nearest drawable text; ᵀ becomes T, and a combining accent is removed."""
    if character in _REPLACEMENTS:
        return _REPLACEMENTS[character]
    if unicodedata.combining(character):
        return ""
    letters = unicodedata.normalize("NFKD", character)
    return "".join(letter for letter in letters if _is_drawable(letter)) or "?"
