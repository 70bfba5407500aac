"""Pins and handles in scenes: nodes that are held, or moved by a script."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field

from qlb.scenes.motions import AnyMotion
from qlb.scenes.selections import OfBody, Selection
from qlb.setting_keys import at_key
from qlb.settings import quantity
from qlb.simulation import Simulation


def _axes(value: str) -> str:
    if not re.fullmatch("[xyz]+", value) or len(set(value)) < len(value):
        raise ValueError(f"{value!r} must be letters out of x, y, z, each once")
    return value


class HoldSettings(OfBody):
    """What pins and handles have in common."""

    nodes: Selection = Field(description="Nodes, by an expression of x, y, z at rest [m]")
    axes: Annotated[str, AfterValidator(_axes)] = Field("xyz", description="Directions that are held, such as y or xz")
    until: float | None = quantity(None, "When they are let go; never by default", unit="s", gt=0)


class PinSettings(HoldSettings):
    """Nodes that are held where they are at rest."""

    def add_to(self, simulation: Simulation, key: str) -> None:
        """Hold them. Raises `InputError` with what lies at `key`."""
        nodes = self.select_nodes(simulation, key, self.nodes)
        with at_key(key):
            simulation.pin(nodes, self.axes, until=self.until)


class HandleSettings(HoldSettings):
    """Nodes that are moved by a script."""

    motion: AnyMotion = Field(description="How they move, such as {kind: translation, velocity: [0.1, 0, 0]}")

    def add_to(self, simulation: Simulation, key: str) -> None:
        """Move them. Raises `InputError` with what lies at `key`."""
        nodes = self.select_nodes(simulation, key, self.nodes)
        with at_key(key):
            simulation.move(nodes, self.motion.motion(), self.axes, until=self.until)
