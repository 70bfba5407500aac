"""Motions of held nodes: where a script puts them at each time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, vectors
from qlb.errors import InputError
from qlb.fields.in_time import check_increasing

Motion = Callable[[FloatArray, float], FloatArray]
"""Positions of held nodes [m]: motion(anchors (k, 3), time [s]) -> (k, 3), equal to the anchors at time 0."""


@dataclass(frozen=True)
class Translation:
    """Moves nodes with a constant velocity [m/s], shape (3,)."""

    velocity: tuple[float, float, float]

    def __call__(self, anchors: FloatArray, time: float) -> FloatArray:
        """Positions [m] at `time` [s]."""
        return anchors + time * np.asarray(self.velocity)


@dataclass(frozen=True)
class Rotation:
    """Turns nodes about an axis through `origin` [m] at `rate` [rev/s], from `start` to `stop` [s]."""

    axis: tuple[float, float, float]
    origin: tuple[float, float, float]
    rate: float
    start: float = 0.0
    stop: float = np.inf

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.axis) > 0:
            raise InputError(f"rotation axis {self.axis} has no length: must be a direction")

    def __call__(self, anchors: FloatArray, time: float) -> FloatArray:
        """Positions [m] at `time` [s], by Rodrigues' formula."""
        angle = 2 * np.pi * self.rate * max(0.0, min(time, self.stop) - self.start)
        k = np.asarray(self.axis, dtype=np.float64) / np.linalg.norm(self.axis)
        r = anchors - np.asarray(self.origin)
        turned = r * np.cos(angle) + np.cross(k, r) * np.sin(angle) + np.outer(r @ k, k) * (1 - np.cos(angle))
        return np.asarray(turned + np.asarray(self.origin))


@dataclass(frozen=True, eq=False)
class Keyframes:
    """Moves nodes as one rigid body through given poses: x(t) = X + d(t) + (R(t) - 1) (X - origin).

    Between two keys the displacement d is interpolated linearly, and the rotation along the shortest way (Shoemake
    1985, "Animating rotation with quaternion curves"). Before the first and after the last key nothing moves.

    Args:
        times: of the keys [s], increasing, shape (k,), the first >= 0.
        translations: d at each key [m], shape (k, 3), zero at the first; none by default.
        rotations: R at each key as a rotation vector [rad], along the axis and as long as the angle, shape (k, 3), zero
            at the first; none by default.
        origin: the point of the body at rest about which it turns, and which d displaces [m].
        ease: "linear" goes from key to key at constant speed, with a jump of the velocity at each. "smooth" takes the
            same path, starts from rest and comes to rest at each key: 3 s^2 - 2 s^3 of the way after the part s of the
            time, so that the velocity is continuous.

    Raises:
        InputError: shapes that do not fit, times that do not increase, a first pose that is not where the body is at
            rest, rotation vectors that lie more than half a turn apart from key to key (put a key between them).
    """

    times: npt.ArrayLike
    translations: npt.ArrayLike | None = None
    rotations: npt.ArrayLike | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ease: Literal["linear", "smooth"] = "linear"
    _turns: Any = field(init=False, repr=False)
    _ways: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=np.float64, ndmin=1)
        if times.ndim != 1 or len(times) == 0 or not np.isfinite(times).all() or times[0] < 0:
            raise InputError(f"times of keyframes {times.tolist()} must be finite and >= 0 s, one or more")
        check_increasing("times of keyframes", times)
        if self.ease not in ("linear", "smooth"):
            raise InputError(f"ease = {self.ease!r} must be 'linear' or 'smooth'")
        checked: dict[str, Any] = {"times": times, "origin": vectors("origin of keyframes", self.origin, (3,))}
        for name in ("translations", "rotations"):
            checked[name] = _keys(name, getattr(self, name), len(times))
        checked["_turns"], checked["_ways"] = _turns(checked["rotations"])
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __call__(self, anchors: FloatArray, time: float) -> FloatArray:
        """Positions [m] at `time` [s]; exactly the anchors up to the first key."""
        from scipy.spatial.transform import Rotation as Turn

        times: Any = self.times
        i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, max(len(times) - 2, 0)))
        last = min(i + 1, len(times) - 1)
        s = 0.0 if last == i else float(np.clip((time - times[i]) / (times[last] - times[i]), 0.0, 1.0))
        if self.ease == "smooth":
            s = s**2 * (3 - 2 * s)
        d: Any = self.translations
        R = (self._turns[i] * Turn.from_rotvec(s * self._ways[i])).as_matrix()
        return np.asarray(anchors + ((1 - s) * d[i] + s * d[last]) + (anchors - self.origin) @ (R - np.eye(3)).T)


@dataclass(frozen=True, eq=False)
class VertexAnimation:
    """Moves each node along a path of its own, linear from key to key; nothing moves before the first and after the
    last.

    Args:
        times: of the keys [s], increasing, shape (k,).
        positions: of the nodes at each key [m], shape (k, q, 3).

    Raises:
        InputError: shapes that do not fit, times that do not increase, a number that is not finite.
    """

    times: npt.ArrayLike
    positions: npt.ArrayLike

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=np.float64, ndmin=1)
        if times.ndim != 1 or len(times) == 0 or not np.isfinite(times).all():
            raise InputError(f"times of an animation {times.tolist()} must be finite, one or more")
        check_increasing("times of an animation", times)
        positions = np.array(self.positions, dtype=np.float64)
        if positions.ndim != 3 or positions.shape[::2] != (len(times), 3):
            allowed = f"({len(times)}, q, 3) for {len(times)} times"
            raise InputError(f"positions of an animation have shape {positions.shape}, must be {allowed}")
        bad = ~np.isfinite(positions).all(axis=2)
        if bad.any():
            k, i = np.argwhere(bad)[0]
            raise InputError(f"vertex {i} of an animation has position {positions[k, i].tolist()} at key {k}")
        for name, array in (("times", times), ("positions", positions)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def vertices(self) -> int:
        """How many nodes it moves."""
        return int(np.shape(self.positions)[1])

    def __call__(self, anchors: FloatArray, time: float) -> FloatArray:
        """Positions [m] at `time` [s], wherever the anchors are."""
        times, keys = np.asarray(self.times), np.asarray(self.positions)
        i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 1))
        if i + 1 == len(times) or time <= times[i]:
            return np.array(keys[i])
        s = (time - times[i]) / (times[i + 1] - times[i])
        return np.asarray((1 - s) * keys[i] + s * keys[i + 1])


def _keys(name: str, given: npt.ArrayLike | None, count: int) -> FloatArray:
    """`given` as an array (count, 3) that begins with zeros."""
    keys = np.asarray(0.0 if given is None else given, dtype=np.float64)
    if given is not None and keys.shape != (count, 3):
        raise InputError(f"{name} of keyframes have shape {keys.shape}, must be ({count}, 3) for {count} times")
    if not np.isfinite(keys).all():
        raise InputError(f"{name} of keyframes must be finite")
    keys = np.array(np.broadcast_to(keys, (count, 3)))
    if keys[0].any():
        raise InputError(f"{name} of keyframes begin with {keys[0].tolist()}, must begin with zeros: the body at rest")
    return keys


def _turns(vectors: FloatArray) -> tuple[Any, FloatArray]:
    """The rotation at each key, and from it to the next a rotation vector in the frame of the key (k, 3); 0 at the end.

    Raises:
        InputError: two rotation vectors in a row that lie more than half a turn apart.
    """
    from scipy.spatial.transform import Rotation as Turn

    steps = np.diff(vectors, axis=0, append=vectors[-1:])
    angles = np.linalg.norm(steps, axis=1)
    if (angles > np.pi * (1 + 1e-9)).any():
        k = int(np.argmax(angles > np.pi * (1 + 1e-9)))
        raise InputError(
            f"rotations of keyframes: numbers {k + 1} and {k + 2} lie {angles[k]:.4g} rad apart, must be at most pi:"
            " put a key between them"
        )
    turns = Turn.from_rotvec(vectors)
    following = Turn.from_rotvec(np.concatenate([vectors[1:], vectors[-1:]]))
    ways = (turns.inv() * following).as_rotvec()
    # Half a turn has two shortest ways; the one along the difference of the vectors is meant.
    half = np.linalg.norm(ways, axis=1) > np.pi - 1e-6
    other = half & (np.sum(ways * steps, axis=1) < 0)
    ways[other] *= 1 - 2 * np.pi / np.linalg.norm(ways[other], axis=1, keepdims=True)
    return turns, ways
