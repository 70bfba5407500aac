"""Motions in scenes: of handles and obstacles."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields import TimeFunction
from qlb.scenes.values import Number, Vector, VectorInTime
from qlb.settings import Settings, quantity
from qlb.system import Keyframes, Motion, Rotation, Translation, VertexAnimation

Times = Annotated[tuple[Number, ...], Field(min_length=1)]
Vectors = Annotated[tuple[Vector, ...], Field(min_length=1)]


class MotionSettings(Settings):
    """A motion that a file can write down."""

    @abstractmethod
    def motion(self) -> Motion:
        """As `Simulation.move` and obstacles take it. Raises `InputError` where it makes none."""

    @model_validator(mode="after")
    def _check(self) -> MotionSettings:
        self.motion()
        return self


class TranslationSettings(MotionSettings):
    """A constant velocity."""

    kind: Literal["translation"] = Field("translation", description="With a constant velocity")
    velocity: Vector = Field(description="[m/s]")

    def motion(self) -> Motion:
        """A `Translation`."""
        return Translation(self.velocity)


class RotationSettings(MotionSettings):
    """A turn about an axis at a constant rate."""

    kind: Literal["rotation"] = Field("rotation", description="About an axis")
    axis: Vector = Field(description="Direction of the axis, of any length > 0")
    origin: Vector = Field((0.0, 0.0, 0.0), description="A point on the axis [m]")
    rate: float = quantity(0.5, "Turns per second", unit="rev/s")
    start: float = quantity(0.0, "When it begins", unit="s", ge=0)
    stop: float | None = quantity(None, "When it ends; never by default", unit="s", ge=0)

    def motion(self) -> Motion:
        """A `Rotation`."""
        return Rotation(self.axis, self.origin, self.rate, self.start, np.inf if self.stop is None else self.stop)


class RotateKeys(Settings):
    """Angles about one axis at each key."""

    axis: Vector = Field(description="Direction of the axis, of any length > 0")
    degrees: Times = Field(description="Angle at each key [degrees], 0 at the first, at most 180 from key to key")


class KeyframesSettings(MotionSettings):
    """Poses of a rigid body at given times."""

    kind: Literal["keyframes"] = Field("keyframes", description="Through poses at given times, as one rigid body")
    times: Times = Field(description="Of the keys [s], increasing")
    translations: Vectors | None = Field(
        None, description="Displacement at each key [m], [0, 0, 0] at the first; none by default"
    )
    rotations: Vectors | None = Field(
        None,
        description="Rotation vector at each key [rad], along the axis, as long as the angle, zero at the first",
    )
    rotate: RotateKeys | None = Field(
        None, description="In place of rotations, turns about one axis, such as {axis: [0, 1, 0], degrees: [0, 90]}"
    )
    origin: Vector = Field((0.0, 0.0, 0.0), description="Point at rest about which it turns [m]")
    ease: Literal["linear", "smooth"] = Field("linear", description="smooth: at rest at each key")

    def motion(self) -> Motion:
        """`Keyframes`."""
        rotations: Any = self.rotations
        if self.rotate is not None:
            if self.rotations is not None:
                raise InputError("rotations and rotate are both given, must be one of them")
            rotations = np.outer(np.radians(self.rotate.degrees), unit(self.rotate.axis))
        return Keyframes(self.times, self.translations, rotations, self.origin, self.ease)


class DisplacementSettings(MotionSettings):
    """A displacement in time, alike for all."""

    kind: Literal["displacement"] = Field("displacement", description="By a function of time, alike for all")
    value: VectorInTime = Field(
        description="Displacement [m], [0, 0, 0] at time 0: expressions in t such as [0, 0.1 * sin(6 * t), 0], or a"
        " table {times: [...], values: [...]}"
    )

    def motion(self) -> Motion:
        """A function."""
        if not isinstance(self.value, TimeFunction):
            raise InputError(f"value {self.value} is constant, must be a function of time or a table")
        start = self.value(0.0)
        if not (start == 0).all():
            raise InputError(f"the displacement at time 0 is {start.tolist()}, must be [0, 0, 0]")
        return _Displacement(self.value)


class AnimationSettings(MotionSettings):
    """A path for each vertex."""

    kind: Literal["animation"] = Field("animation", description="A path for each node or vertex")
    times: Times = Field(description="Of the keys [s], increasing")
    positions: Annotated[tuple[Vectors, ...], Field(min_length=1)] = Field(
        description="Of all vertices at each key [m]: a list of vectors for each time"
    )

    def motion(self) -> Motion:
        """A `VertexAnimation`."""
        counts = sorted(set(map(len, self.positions)))
        if len(counts) > 1:
            raise InputError(f"positions have {counts} vertices, must have as many at each key")
        return VertexAnimation(self.times, self.positions)


@dataclass(frozen=True)
class _Displacement:
    """Shifts nodes by a vector in time [m]."""

    value: TimeFunction

    def __call__(self, anchors: FloatArray, time: float) -> FloatArray:
        return np.asarray(anchors + self.value(time))


def unit(axis: Vector) -> FloatArray:
    """The unit vector along `axis`. Raises `InputError` where it has no length."""
    length = np.linalg.norm(np.asarray(axis) / (np.abs(axis).max() or 1.0)) * np.abs(axis).max()
    if not (length > 0 and np.isfinite(length)):
        raise InputError(f"rotation axis {axis} has no length: must be a direction")
    return np.asarray(np.asarray(axis) / length)


def _kind(value: object) -> str | None:
    found = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return found if isinstance(found, str) else None


AnyMotion = Annotated[
    Annotated[TranslationSettings, Tag("translation")]
    | Annotated[RotationSettings, Tag("rotation")]
    | Annotated[KeyframesSettings, Tag("keyframes")]
    | Annotated[DisplacementSettings, Tag("displacement")]
    | Annotated[AnimationSettings, Tag("animation")],
    Discriminator(_kind),
]
"""Any motion of a scene file, told apart by `kind`: the one list of them."""
