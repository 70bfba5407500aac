"""Motions of held nodes: translations, rotations and keyframes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from qlb import InputError, Keyframes, Rotation, Simulation, StableNeoHookean, Translation
from tests.support import Array, finish, random_rotation, right_end, small_bar


def test_translation_moves_with_constant_velocity(rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(5, 3))
    moved = Translation((1.0, -2.0, 0.5))(anchors, 0.4)
    np.testing.assert_allclose(moved - anchors, np.tile([0.4, -0.8, 0.2], (5, 1)), atol=1e-15)


def test_rotation_returns_after_a_turn(rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(5, 3))
    turn = Rotation(axis=(1.0, 2.0, -0.5), origin=(0.3, 0.1, 0.2), rate=0.25)
    for time in (0.0, 4.0, 8.0):
        np.testing.assert_allclose(turn(anchors, time), anchors, rtol=0, atol=1e-14)


def test_rotation_turns_counterclockwise_about_its_axis() -> None:
    quarter = Rotation(axis=(0.0, 0.0, 2.0), origin=(1.0, 0.0, 5.0), rate=1.0)
    np.testing.assert_allclose(quarter(np.array([[2.0, 0.0, 7.0]]), 0.25), [[1.0, 1.0, 7.0]], atol=1e-15)


def test_rotation_keeps_distances(rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(8, 3))
    turned = Rotation(axis=(1.0, 2.0, 3.0), origin=(0.1, 0.0, 0.0), rate=0.7)(anchors, 0.31)
    lengths = [np.linalg.norm(x[:, None] - x[None], axis=2) for x in (anchors, turned)]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=0, atol=1e-14)


def test_rotation_turns_between_its_start_and_its_stop(rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(5, 3))
    turn = Rotation(axis=(1, 0, 0), origin=(0, 0, 0), rate=0.5, start=1.0, stop=2.0)
    free = Rotation(axis=(1, 0, 0), origin=(0, 0, 0), rate=0.5)
    np.testing.assert_allclose(turn(anchors, 0.7), anchors, atol=1e-15)
    np.testing.assert_allclose(turn(anchors, 1.5), free(anchors, 0.5), atol=1e-15)
    np.testing.assert_array_equal(turn(anchors, 9.0), turn(anchors, 2.0))


def test_an_axis_of_no_length_is_refused() -> None:
    with pytest.raises(InputError, match="axis"):
        Rotation(axis=(0.0, 0.0, 0.0), origin=(0.0, 0.0, 0.0), rate=1.0)


TIMES = [0.0, 0.5, 2.0, 2.5]
SHIFTS = [[0, 0, 0], [1, 2, 0], [1, 2, 3], [0, 0, 0]]
TURNS = [[0, 0, 0], [0, 0, 1.5], [0.5, -0.2, 3.0], [1.0, 0.0, 5.0]]
ORIGIN = (0.3, 0.1, -0.2)
EASES = ["linear", "smooth"]


def keyframes(ease: str) -> Keyframes:
    return Keyframes(TIMES, SHIFTS, TURNS, ORIGIN, ease)  # type: ignore[arg-type]


def turned(x: Array, vector: list[float]) -> Array:
    """`x` (k, 3) turned about an axis through 0 by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    k = np.asarray(vector) / (angle or 1.0)
    return x * np.cos(angle) + np.cross(k, x) * np.sin(angle) + np.outer(x @ k, k) * (1 - np.cos(angle))


@pytest.mark.parametrize("ease", EASES)
def test_keyframes_are_at_each_key_where_it_says(ease: str, rng: np.random.Generator) -> None:
    anchors, motion = rng.normal(size=(6, 3)), keyframes(ease)
    for time, shift, turn in zip(TIMES, SHIFTS, TURNS, strict=True):
        expected = turned(anchors - ORIGIN, turn) + ORIGIN + shift
        np.testing.assert_allclose(motion(anchors, time), expected, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(motion(anchors, 0.0), anchors)
    np.testing.assert_array_equal(motion(anchors, 99.0), motion(anchors, TIMES[-1]))


@pytest.mark.parametrize("ease", EASES)
def test_keyframes_keep_distances_and_orientation(ease: str, rng: np.random.Generator) -> None:
    anchors, motion = rng.normal(size=(8, 3)), keyframes(ease)
    edges = anchors[1:] - anchors[0]
    for time in rng.uniform(0, 3, 20):
        moved = motion(anchors, time)[1:] - motion(anchors, time)[0]
        np.testing.assert_allclose(moved @ moved.T, edges @ edges.T, rtol=0, atol=1e-12)
        assert np.linalg.det(moved[:3]) == pytest.approx(np.linalg.det(edges[:3]), rel=1e-11)


def velocity(motion: Keyframes, anchors: Array, time: float, side: float) -> Array:
    step = side * 1e-6
    return (motion(anchors, time + step) - motion(anchors, time)) / step


@pytest.mark.parametrize("ease", EASES)
def test_keyframes_move_without_a_jump(ease: str, rng: np.random.Generator) -> None:
    anchors, motion = rng.normal(size=(4, 3)), keyframes(ease)
    times = np.linspace(-0.1, 2.6, 2701)
    path = np.stack([motion(anchors, t) for t in times])
    assert np.abs(np.diff(path, axis=0)).max() < 0.03


def test_linear_keyframes_keep_their_speed_from_key_to_key(rng: np.random.Generator) -> None:
    anchors, motion = rng.normal(size=(4, 3)), keyframes("linear")
    for begin, end in pairwise(TIMES):
        speeds = []
        for s in (0.1, 0.5, 0.9):
            time = begin + s * (end - begin)
            edges = velocity(motion, anchors, time, 1.0)
            speeds.append(np.linalg.norm(edges - edges[0]))  # of the rotation alone
        np.testing.assert_allclose(speeds, speeds[0], rtol=1e-4)
    assert np.abs(velocity(motion, anchors, 0.5, 1.0) - velocity(motion, anchors, 0.5, -1.0)).max() > 0.5


def test_smooth_keyframes_have_a_continuous_velocity_that_vanishes_at_keys(rng: np.random.Generator) -> None:
    anchors, motion = rng.normal(size=(4, 3)), keyframes("smooth")
    for time in [*TIMES, 0.2, 1.0, 2.2]:
        before, after = velocity(motion, anchors, time, -1.0), velocity(motion, anchors, time, 1.0)
        np.testing.assert_allclose(before, after, rtol=0, atol=1e-3)
        assert (np.abs(after).max() < 1e-3) == (time in TIMES)


@pytest.mark.parametrize("ease", EASES)
def test_both_eases_take_the_same_path(ease: str, rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(4, 3))
    s = 0.3
    linear = keyframes("linear")(anchors, 0.5 + 1.5 * (3 * s**2 - 2 * s**3))
    np.testing.assert_allclose(keyframes("smooth")(anchors, 0.5 + 1.5 * s), linear, rtol=0, atol=1e-13)


def test_rotations_between_keys_take_the_shortest_way(rng: np.random.Generator) -> None:
    R = random_rotation(rng)
    angle = np.arccos((np.trace(R) - 1) / 2)
    vector = angle / (2 * np.sin(angle)) * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    anchors, motion = rng.normal(size=(5, 3)), Keyframes([0, 1], rotations=[[0, 0, 0], vector])
    np.testing.assert_allclose(motion(anchors, 1.0), anchors @ R.T, rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion(anchors, 0.25), turned(anchors, list(0.25 * vector)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_half_turns_add_up_to_turns_about_one_axis(sense: float) -> None:
    # Each key is half a turn on from the last: the way is that of the difference of the rotation vectors.
    axis = np.array([2.0, -1.0, 2.0]) / 3
    motion = Keyframes(range(7), rotations=sense * np.pi * np.outer(range(7), axis))
    free = Rotation(axis=tuple(axis), origin=(0.0, 0.0, 0.0), rate=0.5 * sense)
    anchors = np.eye(3)
    for time in np.linspace(0, 6, 25):
        np.testing.assert_allclose(motion(anchors, time), free(anchors, time), rtol=0, atol=1e-12)


def test_small_steps_after_more_than_half_a_turn_stay_small() -> None:
    # The vectors differ across the axis, where turns beyond pi go against them.
    motion = Keyframes([0, 1, 2, 3], rotations=[[0, 0, 0], [0, 0, 2.2], [0, 0, 4.5], [0.3, 0, 4.5]])
    path = np.stack([motion(np.eye(3), t) for t in np.linspace(2, 3, 20)])
    assert np.abs(np.diff(path, axis=0)).max() < 0.02


def test_one_key_holds_the_nodes_and_a_late_first_key_waits(rng: np.random.Generator) -> None:
    anchors = rng.normal(size=(4, 3))
    np.testing.assert_array_equal(Keyframes([0])(anchors, 3.0), anchors)
    late = Keyframes([1, 2], [[0, 0, 0], [1, 0, 0]])
    np.testing.assert_array_equal(late(anchors, 0.7), anchors)
    np.testing.assert_allclose(late(anchors, 1.5), anchors + np.array([0.5, 0, 0]), rtol=0, atol=1e-15)


@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2", "quasistatic"])
def test_a_body_follows_keyframes_without_strain(integrator: str) -> None:
    mesh = small_bar()
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(),
        integrator=integrator,
        solver="ND",
        step=0.05,
        gravity=(0, 0, 0),
        threads=1,
    )
    motion = Keyframes([0, 1], [[0, 0, 0], [0.5, 0, 0]], [[0, 0, 0], [0, 0.8, 0]], ease="smooth")
    simulation.move(np.arange(len(mesh.positions)), motion)
    for result in simulation.run(3):
        np.testing.assert_array_equal(result.positions, motion(mesh.positions, result.time))
    partly = Simulation(mesh, material=StableNeoHookean(), integrator="quasistatic", gravity=(0, 0, 0), threads=1)
    partly.move(right_end(mesh), motion)
    state = finish(partly, 3)
    np.testing.assert_allclose(state.positions, motion(mesh.positions, state.time), rtol=0, atol=1e-6)


ZERO, ONE = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]
WRONG = {
    "times": (([0, 2, 1], [ZERO] * 3), r"times of keyframes must increase: number 3 is 1 s, after 2 s"),
    "equal times": (([0, 1, 1], [ZERO] * 3), "times of keyframes must increase"),
    "negative times": (([-1, 1], [ZERO] * 2), r"times of keyframes \[-1.0, 1.0\] must be finite and >= 0 s"),
    "no times": (([], []), "one or more"),
    "nan": (([0, np.nan], [ZERO] * 2), "must be finite"),
    "too few": (([0, 1], [ZERO]), r"translations of keyframes have shape \(1, 3\), must be \(2, 3\) for 2 times"),
    "quaternions": (([0, 1], None, [[1, 0, 0, 0]] * 2), r"rotations of keyframes have shape \(2, 4\)"),
    "displaced": (([0, 1], [ONE, ZERO]), "translations of keyframes begin with .* must begin with zeros"),
    "turned": (([0, 1], None, [ONE, ZERO]), "rotations of keyframes begin with .* must begin with zeros"),
    "infinite": (([0, 1], [ZERO, [np.inf, 0, 0]]), "translations of keyframes must be finite"),
    "a whole turn": (
        ([0, 1], None, [ZERO, [0, 0, 6.3]]),
        "rotations of keyframes: numbers 1 and 2 lie 6.3 rad apart, must be at most pi: put a key between",
    ),
    "ease": (([0, 1], None, None, (0, 0, 0), "quick"), "ease = 'quick' must be 'linear' or 'smooth'"),
    "origin": (([0, 1], None, None, (0, 0)), "origin of keyframes has shape"),
}


@pytest.mark.parametrize(("arguments", "message"), WRONG.values(), ids=WRONG)
def test_wrong_keyframes_are_refused(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        Keyframes(*arguments)  # type: ignore[arg-type]
    assert "\n" not in str(refusal.value)
