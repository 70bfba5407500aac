"""Where a scene comes from, so that errors can say it."""

from __future__ import annotations

from dataclasses import dataclass

from qlb.errors import InputError
from qlb.scenes.document import Document
from qlb.setting_keys import SettingError


@dataclass(frozen=True)
class Source:
    """Where a scene comes from.

    Attributes:
        document: its file, or None for a built-in scene.
        changed: keys that KEY=VALUE pairs have set since.
    """

    document: Document | None
    changed: tuple[str, ...] = ()

    def located(self, error: InputError) -> InputError:
        """`error` with the place in the file that it is about in front."""
        if self.document is None:
            return error
        key = error.key if isinstance(error, SettingError) else ""
        if any(f"{key}.".startswith(f"{changed}.") for changed in self.changed):
            return error
        return SettingError(key, f"{self.document.at(self.document.place(key))}: {error}")
