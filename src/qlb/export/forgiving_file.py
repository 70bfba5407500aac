"""A file for libraries that do not survive a full disk."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any


class ForgivingFile(io.RawIOBase):
    """A new file that keeps the first error of the system to itself until it is asked for by `check`.

    HDF5 cannot close a file that it cannot write to, and brings the process down when it tries again at the end. Here
    all goes well for it: what cannot be written is dropped, and reads as zeros.
    """

    def __init__(self, path: Path) -> None:
        self._file = io.FileIO(path, "w+")
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the `OSError` that was kept, if there is one."""
        if self._error is not None:
            raise self._error

    def write(self, data: Any, /) -> int:
        """All of `data`, as far as the system lets it."""
        view = memoryview(data).cast("B")
        size = len(view)
        try:
            while self._error is None and len(view):
                view = view[self._file.write(view) :]
        except OSError as error:
            self._error = error
        return size

    def readinto(self, buffer: Any, /) -> int:
        """Fill all of `buffer`."""
        view = memoryview(buffer).cast("B")
        found = self._file.readinto(view) or 0
        view[found:] = bytes(len(view) - found)
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        """Make the file `size` bytes long."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._error = self._error or error
            return size or 0

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Go to a place."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """The place."""
        return self._file.tell()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()

    def readable(self) -> bool:
        """It is."""
        return True

    def writable(self) -> bool:
        """It is."""
        return True

    def seekable(self) -> bool:
        """It is."""
        return True
