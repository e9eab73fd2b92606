"""Settings that hold for all tests."""

from hypothesis import settings

settings.register_profile("same every time", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("same every time")
