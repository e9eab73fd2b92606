"""A guard for tests: no answer of `active-set` may come from its fallback."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from taskopt.hierarchy.resolution import Resolution


@contextmanager
def forbidden_fallback(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail at the end of the block if a resolution names a fallback that was made inside it."""
    names: list[str] = []
    original = Resolution.replaced

    def recorded(self: Resolution, *args: object, **changes: object) -> Resolution:
        new = original(self, *args, **changes)  # type: ignore[arg-type]
        if new.fallback is not None:
            names.append(new.fallback)
        return new

    monkeypatch.setattr(Resolution, "replaced", recorded)
    yield
    if names:
        pytest.fail(f"the active set found no optimum {len(names)} times; {names[0]} answered")
