"""Where a mesh lies, in scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import Field, model_validator

from qlb.arrays import FloatArray
from qlb.bodies import Placement
from qlb.errors import InputError
from qlb.scenes.motions import unit
from qlb.scenes.values import Vector
from qlb.settings import Settings, quantity


class RotateSettings(Settings):
    """A turn in degrees."""

    axis: Vector = Field((0.0, 1.0, 0.0), description="Direction of the axis, of any length > 0")
    degrees: float = quantity(0.0, "Angle", unit="degrees")


class PlacementSettings(Settings):
    """Scales, then turns, then shifts a mesh; what comes out is the shape at rest."""

    scale: float = quantity(1.0, "Of all lengths", gt=0)
    height: float | None = quantity(None, "In place of scale: its length along y before it is turned", unit="m", gt=0)
    rotation: Vector = Field((0.0, 0.0, 0.0), description="Rotation vector [rad], along the axis, as long as the angle")
    rotate: RotateSettings | None = Field(
        None, description="In place of rotation, in degrees, such as {axis: [0, 0, 1], degrees: 30}"
    )
    origin: Vector | None = Field(None, description="About which it turns and scales [m]; its middle by default")
    translation: Vector = Field((0.0, 0.0, 0.0), description="[m]")
    lowest: float | None = quantity(
        None, "In place of the y of translation: y of its lowest point in the end", unit="m"
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> PlacementSettings:
        given = [
            ("scale", "height", self.scale != 1.0 and self.height is not None),
            ("rotation", "rotate", any(self.rotation) and self.rotate is not None),
            ("the y of translation", "lowest", self.translation[1] != 0.0 and self.lowest is not None),
        ]
        for one, other, both in given:
            if both:
                raise InputError(f"{one} and {other} are both given, must be one of them")
        if self.rotate is not None:
            unit(self.rotate.axis)
        return self

    def of(self, positions: FloatArray, centre: FloatArray) -> Placement:
        """What places a mesh or surface with `positions` [m] (n, 3) about its `centre` [m] (3,).

        Raises:
            InputError: a height is asked for of what has none.
        """
        scale = self.scale
        if self.height is not None:
            tall = float(np.ptp(positions[:, 1]))
            if not tall > 0:
                raise InputError(f"height = {self.height:g} m is asked for of something that has none")
            scale = self.height / tall
        rotation = self.rotation
        if self.rotate is not None:
            x, y, z = (np.radians(self.rotate.degrees) * unit(self.rotate.axis)).tolist()
            rotation = (x, y, z)
        placed = Placement(scale, rotation, self.translation, self.origin)
        if self.lowest is not None:
            x, _, z = self.translation
            low = float(placed.moved(positions, centre)[:, 1].min())
            placed = replace(placed, translation=(x, self.lowest - low, z))
        return placed
