"""Every answer in the tests of this folder is the active set's own."""

from collections.abc import Iterator

import pytest

from tests.helpers.fallbacks import forbidden_fallback


@pytest.fixture(autouse=True)
def own_answers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Fail a test in which another method answered in the place of the active set."""
    with forbidden_fallback(monkeypatch):
        yield
