"""Deformation gradients of every kind that a solver meets."""

from __future__ import annotations

import numpy as np

from qlb.materials import MATERIALS
from tests.support import Array, random_rotation

COUNT = 21  # not a multiple of any SIMD width

# Where a projection is less exact than rounding: its frame comes from F^T F, so two stretches that both lie below
# sqrt(eps) = 1.5e-8 of the largest are told apart to that; a slender F loses its stretch ratio, squared.
PROJECTION_ACCURACY = {"nearly rank one": 1e-8, "slender": 1e-11}


def from_stretches(rng: np.random.Generator, *stretches: float) -> Array:
    """U diag(stretches) V^T with random rotations U and V."""
    return np.stack([random_rotation(rng) @ np.diag(stretches) @ random_rotation(rng).T for _ in range(COUNT)])


def random(rng: np.random.Generator) -> Array:
    return np.eye(3) + rng.normal(size=(COUNT, 3, 3))


def random_upright(rng: np.random.Generator) -> Array:
    return np.concatenate([from_stretches(rng, *rng.uniform(0.4, 2.5, 3)) for _ in range(3)])


def near_rest(rng: np.random.Generator) -> Array:
    return np.eye(3) + 1e-3 * rng.normal(size=(COUNT, 3, 3))


def inverted(rng: np.random.Generator) -> Array:
    F = random(rng)
    F[np.linalg.det(F) > 0, 0] *= -1
    return F


# All that any material must get right, by name.
KINDS = {
    "random": random,
    "random, not inverted": random_upright,
    "near rest": near_rest,
    "at rest": lambda rng: np.eye(3)[None],
    "rotated": lambda rng: from_stretches(rng, 1, 1, 1),
    "inverted": inverted,
    "reflected": lambda rng: from_stretches(rng, 1, 1, -1),
    "two stretches equal": lambda rng: from_stretches(rng, 2, 2, 0.5),
    "two stretches opposite": lambda rng: from_stretches(rng, 1.5, 0.7, -0.7),
    "stretches nearly equal": lambda rng: from_stretches(rng, 1.3, 1.3 + 1e-9, 1.3 - 1e-9),
    "slender": lambda rng: from_stretches(rng, 30, 0.05, 0.04),
    "rank two": lambda rng: from_stretches(rng, 2, 0.5, 0),
    "rank one": lambda rng: from_stretches(rng, 2, 0, 0),
    "nearly rank one": lambda rng: from_stretches(rng, 1, 3e-8, -1e-8),
    "zero": lambda rng: np.zeros((1, 3, 3)),
    "nearly zero": lambda rng: 1e-9 * rng.normal(size=(COUNT, 3, 3)),
    "axis reflections": lambda rng: np.stack(
        [np.diag(d) for d in [(1.0, 1.0, -1.0), (1.0, -1.0, 1.0), (-1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)]]
    ),
}

# psi has log J or J^-2/3: only det F > 0.
UPRIGHT = ["random, not inverted", "near rest", "at rest", "rotated", "two stretches equal", "stretches nearly equal"]
# R is not unique where two stretches add up to zero, nor is it smooth near there.
UNIQUE_ROTATION = [*UPRIGHT, "rank two"]


def kinds_for(name: str) -> list[str]:
    """The kinds of F at which a material and its derivatives are defined."""
    domain = MATERIALS[name].domain if name in MATERIALS else "everywhere"
    return {"everywhere": list(KINDS), "det F > 0": UPRIGHT, "unique R": UNIQUE_ROTATION}[domain]
