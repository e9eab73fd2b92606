"""The folder of compiled kernels, shared by all environments and checkouts of a user.

It is `taskopt/kernels` in NUMBA_CACHE_DIR, else in XDG_CACHE_HOME, else in ~/.cache. A file is named
after the kernel and the content that it was compiled from, and is never changed, so any number of
processes may read and write at once. What has not been used for 30 days is deleted by the next process
that compiles something; beyond 500 MB, the files unused for longest go first. A file that a process was
killed while writing goes after an hour.
"""

import os
import tempfile
import time
import zlib
from contextlib import suppress
from functools import cached_property
from pathlib import Path

KEPT_DAYS = 30.0  # an older file belongs to code that nobody runs any more
KEPT_BYTES = 500e6  # about ten full sets of kernels
_TOUCHED_DAYS = 1.0  # how exactly the time of the last use is known
_DAY = 86400.0
_WRITING = ".writing-"  # begins the name of a file that is not complete
_WRITING_DAYS = 1.0 / 24.0  # writing takes milliseconds; an older one was left by a process that was killed


class Store:
    """Reads and writes the files of one folder.

    Args:
        folder: Where the files are, or None if no place is known at all.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self._cleaned = False

    @cached_property
    def writable(self) -> bool:
        """True if the folder can be made and files can be written into it."""
        if self.folder is None:
            return False
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=self.folder).close()
        except OSError:
            return False
        return True

    def names(self) -> set[str]:
        """Return the names of all files, none if there is no folder."""
        try:
            return set(os.listdir(self.folder)) if self.folder else set()  # noqa: PTH208
        except OSError:
            return set()

    def read(self, name: str) -> bytes | None:
        """Return what was written under a name, or None if it is missing or damaged."""
        if self.folder is None:
            return None
        path = self.folder / name
        try:
            data = path.read_bytes()
            age = time.time() - path.stat().st_mtime
        except OSError:
            return None
        if age > _TOUCHED_DAYS * _DAY:
            with suppress(OSError):  # the folder may be read-only; then nothing is deleted either
                os.utime(path)
        return data[4:] if zlib.crc32(data[4:]).to_bytes(4, "little") == data[:4] else None

    def write(self, name: str, data: bytes) -> None:
        """Write a file in one step: other processes see all of it or nothing."""
        if self.folder is None or not self.writable:
            return
        with suppress(OSError):  # a full disk costs the next process its time, but this one may go on
            handle, temporary = tempfile.mkstemp(dir=self.folder, prefix=_WRITING)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(zlib.crc32(data).to_bytes(4, "little") + data)
                Path(temporary).replace(self.folder / name)
            finally:
                Path(temporary).unlink(missing_ok=True)
        if not self._cleaned:
            self._cleaned = True
            self.clean()

    def clean(self) -> None:
        """Delete what is incomplete or unused for `KEPT_DAYS`, then the oldest files beyond `KEPT_BYTES`."""
        if self.folder is None:
            return
        found = []
        for name in self.names():
            with suppress(OSError):  # another process may have deleted it
                stat = (self.folder / name).stat()
                found.append((stat.st_mtime, stat.st_size, name))
        total = 0
        for used, size, name in sorted(found, reverse=True):
            total += size
            days = _WRITING_DAYS if name.startswith(_WRITING) else KEPT_DAYS
            if total > KEPT_BYTES or time.time() - used > days * _DAY:
                with suppress(OSError):
                    (self.folder / name).unlink()


def users_folder(configured: str) -> Path | None:
    """Find the folder in which this user's compiled kernels are kept.

    It is `taskopt/kernels` in the first of three places that is set: NUMBA_CACHE_DIR, XDG_CACHE_HOME, and
    `.cache` in the home of the user.

    Args:
        configured: NUMBA_CACHE_DIR as Numba has it; "" if it is not set.

    Returns:
        The folder, which may not exist yet; None if the user has no home and neither variable is set.
    """
    base = configured or os.environ.get("XDG_CACHE_HOME", "")
    try:
        root = Path(base) if base else Path.home() / ".cache"
    except RuntimeError:  # no HOME, and the user is not in the password file
        return None
    return root / "taskopt" / "kernels"
