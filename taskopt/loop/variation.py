"""Variations of a scenario, as options of the command line state them."""

from ast import literal_eval
from collections.abc import Sequence
from dataclasses import replace

from taskopt.errors import InvalidValue
from taskopt.loop.scenario import Scenario

_WORDS = {"true": True, "false": False}


def varied(
    scenario: Scenario, changes: Sequence[str], duration: float | None = None, dt: float | None = None
) -> Scenario:
    """Vary the parameters, the length or the period of a scenario.

    Args:
        scenario: The scenario.
        changes: Texts of the form ADDRESS=VALUE, such as "hand.weight=0.1".
        duration: Length of the run [s]; None: as it is.
        dt: Time between ticks [s]; None: as it is.

    Returns:
        A new scenario.

    Raises:
        UnknownName: There is no parameter of that address.
        InvalidValue: A text has another form, or a value is out of its range.
    """
    settings = dict(scenario.settings) | dict(map(setting, changes))
    return replace(
        scenario,
        settings=settings,
        duration=scenario.duration if duration is None else duration,
        dt=scenario.dt if dt is None else dt,
    )


def setting(text: str) -> tuple[str, object]:
    """Read an option that sets a parameter.

    Args:
        text: Text such as "hand.weight=0.1".

    Returns:
        Address and value.

    Raises:
        InvalidValue: The text has another form.
    """
    address, equals, value = text.partition("=")
    if not equals or not value:
        raise InvalidValue(f"--set must have the form ADDRESS=VALUE, such as hand.weight=0.1, got '{text}'")
    if value.lower() in _WORDS:
        return address, _WORDS[value.lower()]
    try:
        read = literal_eval(value)
    except (ValueError, SyntaxError):
        return address, value  # letters, such as axes
    return address, float(read) if isinstance(read, int) else read
