"""Scene files that are broken in hundreds of ways end in one `InputError`: no other exception, no hang, no crash."""

from __future__ import annotations

import copy
import os
import random
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from qlb import InputError
from qlb.scenes import load_scene
from qlb.scenes.document import read_document
from qlb.scenes.files import PARSERS

SEED_TEXT = """
scene: bodies
version: 1
bodies:
  - name: a
    mesh: {shape: box, size: [0.2, 0.2, 0.2], tets: 100}
    material: {model: SNH, young: 2e4 * (1 + y ** 2), poisson: 0.4, density: 1000}
    fibres: [{model: StVK, modulus: 10, direction: [0, 1, x]}]
    placement: {scale: 1, rotate: {axis: [0, 1, 0], degrees: 10}, translation: [0, 0, 0], lowest: 0.1}
    velocity: [0, 0, 1]
  - name: b
    mesh: {shape: box, size: [0.1, 0.1, 0.1], tets: 100}
    placement: {translation: [1, 0, 0]}
pins: [{body: a, nodes: y < 0.11, axes: y, until: 0.1}]
handles:
  - {body: a, nodes: y > 0.29, motion: {kind: keyframes, times: [0, 1], translations: [[0, 0, 0], [0, 1, 0]]}}
  - {body: b, nodes: x > 1, motion: {kind: rotation, axis: [1, 0, 0], rate: 1}}
obstacles:
  - {name: ground, point: [0, -1, 0], normal: [0, 1, 0], motion: {kind: displacement, value: [t, 0, 0]}}
  - {name: wall, mesh: {shape: box, tets: 100}, placement: {translation: [5, 0, 0]}}
loads:
  gravity: [0, -9.81 * t, 0]
  pressure: [{body: b, faces: x > 1, value: {times: [0, 1], values: [0, 10]}}]
contact: {friction: 0.3, pairs: [{between: [a, ground], friction: 0.1}]}
integrator: SDIRK2
solver: ND
step: 0.01
steps: 2
tolerance: {relative: 1e-5}
solver_settings: {window: 5}
threads: 1
"""
SEED = yaml.safe_load(SEED_TEXT)
LIMIT = 20.0
"""Seconds of CPU time that one file may take to be refused."""

WRONG: list[Any] = [
    None, True, [], {}, [None], "", "nonsense", "__import__('os').system('true')", float("nan"), float("inf"), 1e400,
    -1e300, 10**300, [1, 2], [[1]], {"x": {"y": 3}}, {"times": [0]}, "9**9**9**9", "\x00", "(" * 300, b"bytes",
]  # fmt: skip
UNITS = ["1 kPa", "20 kN/m^2", "3mm", "0.01s", "30 deg", "50%", "1,5", "١٢", "1e", "--3", "0x", "½"]


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, part in inner:
        yield (*path, key)
        yield from places(part, (*path, key))


def at(data: Any, path: tuple[Any, ...]) -> Any:
    for step in path:
        data = data[step]
    return data


def with_value(path: tuple[Any, ...], value: Any) -> str:
    data = copy.deepcopy(SEED)
    at(data, path[:-1])[path[-1]] = value
    return yaml.dump(data, allow_unicode=True)


def truncated(rng: random.Random) -> str:
    return SEED_TEXT[: rng.randrange(1, len(SEED_TEXT) - 20)]


def wrong_kind(rng: random.Random) -> str:
    return with_value(rng.choice(list(places(SEED))), rng.choice(WRONG))


def wrong_unit(rng: random.Random) -> str:
    numbers = [p for p in places(SEED) if isinstance(at(SEED, p), int | float) and not isinstance(at(SEED, p), bool)]
    return with_value(rng.choice(numbers), rng.choice(UNITS))


def not_finite(rng: random.Random) -> str:
    numbers = [p for p in places(SEED) if isinstance(at(SEED, p), int | float)]
    return with_value(rng.choice(numbers), rng.choice([float("nan"), float("inf"), -float("inf")]))


def unknown_key(rng: random.Random) -> str:
    owners = [p for p in ((), *places(SEED)) if isinstance(at(SEED, p), dict)]
    return with_value((*rng.choice(owners), rng.choice(["", "x y", "bodys", "Name", "_", "model2", "\u2028", "9"])), 1)


def missing_key(rng: random.Random) -> str:
    paths = [
        ("bodies",),
        ("bodies", 0, "mesh"),
        ("pins", 0, "nodes"),
        ("handles", 0, "motion"),
        ("handles", 1, "motion", "axis"),
        ("handles", 0, "motion", "times"),
        ("handles", 1, "motion", "kind"),
        ("bodies", 1, "mesh", "shape"),
        ("loads", "pressure", 0, "value"),
        ("contact", "pairs", 0, "between"),
    ]
    path = rng.choice(paths)
    data = copy.deepcopy(SEED)
    del at(data, path[:-1])[path[-1]]
    return yaml.dump(data)


def unknown_name(rng: random.Random) -> str:
    paths = [
        ("pins", 0, "body"),
        ("handles", 1, "body"),
        ("loads", "pressure", 0, "body"),
        ("contact", "pairs", 0, "between", 1),
        ("bodies", 1, "name"),
        ("obstacles", 0, "name"),
    ]
    path = rng.choice(paths)
    return with_value(path, "a" if path[-1] == "name" else rng.choice(["c", "A", "", "ground ", "body 0", "0"]))


def duplicate(rng: random.Random) -> str:
    lines = SEED_TEXT.strip().splitlines()
    top = [line for line in lines if line[0].isalpha()]
    return "\n".join([*lines, rng.choice(top).split(":")[0] + ": 1"])


def cyclic(rng: random.Random) -> str:
    path = rng.choice([p for p in places(SEED) if isinstance(at(SEED, p), dict | list)])
    data = copy.deepcopy(SEED)
    inner = at(data, path)
    if isinstance(inner, dict):
        inner["self"] = rng.choice([data, inner])
    else:
        inner.append(rng.choice([data, inner]))
    return yaml.dump(data)


def deep(rng: random.Random) -> str:
    depth = rng.choice([60, 2000, 200_000])
    text = rng.choice(["[" * depth, "{a: " * depth, "- " * depth, "[" * depth + "]" * depth, "? " * depth])
    return f"bodies: {text}" if text[0] in "[{" else text


def laughs(rng: random.Random) -> str:
    width = rng.choice([2, 9, 50])
    lines = ["x0: &x0 [1, 2]"] + [f"x{k}: &x{k} [{', '.join([f'*x{k - 1}'] * width)}]" for k in range(1, 40)]
    return SEED_TEXT + "\n".join(lines)


def bytes_at_random(rng: random.Random) -> bytes:
    if rng.random() < 0.5:
        return rng.randbytes(rng.randrange(1, 3000))
    spoilt = bytearray(SEED_TEXT.encode())
    for _ in range(rng.randrange(1, 4)):
        spoilt[rng.randrange(len(spoilt))] = rng.choice([0, 0x80, 0xC3, 0xFF, 0x07])
    return bytes(spoilt)


MESH = ("bodies", 0, "mesh")
HUGE: list[tuple[tuple[Any, ...], Any]] = [
    ((*MESH, "tets"), 10**12),
    ((*MESH, "tets"), 10**300),
    ((*MESH, "size"), [1e-300, 1, 1e300]),
    (MESH, {"shape": "box", "edge": 1e-9}),
    (MESH, {"shape": "box", "edge": 5e-324}),
    (MESH, {"shape": "ball", "edge": 1e-9}),
    (MESH, {"shape": "cylinder", "radius": 1e-200, "height": 1e200}),
    (MESH, {"shape": "cylinder", "radius": 1e-6, "height": 1}),
    (MESH, {"shape": "torus", "radius": 1e300}),
    (MESH, {"path": "x" * 10**5}),
    (MESH, {"path": "\x00"}),
    (MESH, {"path": "."}),
    (MESH, {"path": "/dev/zero"}),
    (("obstacles", 1, "mesh"), {"shape": "torus", "edge": 1e-30}),
    (("bodies", 0, "placement"), {"scale": 1e300}),
    (("bodies", 0, "placement"), {"height": 1e-320}),
    (("bodies", 0, "placement", "translation"), [1e200, 0, 0]),
    (("bodies", 0, "name"), ["x" * 10**5]),
    (("steps",), 10**18),
    (("steps",), 10**300),
    (("threads",), 10**9),
    (("solver_settings", "window"), 10**9),
    (("solver_settings", "max_iterations"), 0),
]


MUTATIONS: list[tuple[Callable[[random.Random], str | bytes], int, bool]] = [
    (truncated, 20, False),
    (wrong_kind, 40, False),
    (wrong_unit, 16, True),
    (not_finite, 16, True),
    (unknown_key, 18, True),
    (missing_key, 14, True),
    (unknown_name, 12, True),
    (duplicate, 8, True),
    (cyclic, 16, True),
    (deep, 12, True),
    (laughs, 4, True),
    (bytes_at_random, 20, True),
]
"""What makes a file, how often, and whether what it makes is always wrong."""


def files() -> list[Any]:
    found = []
    for make, count, wrong in MUTATIONS:
        for k in range(count):
            rng = random.Random(f"{make.__name__} {k}")
            found.append(pytest.param(make(rng), wrong, id=f"{make.__name__}-{k}"))
    huge = [pytest.param(with_value(*one), True, id=f"huge-{k}") for k, one in enumerate(HUGE)]
    return [*found, *huge]


FILES = files()


def test_there_are_as_many_as_are_promised():
    assert len(FILES) >= 200


def test_the_file_that_is_broken_is_right(tmp_path):
    (tmp_path / "scene.yaml").write_text(SEED_TEXT)
    simulation = load_scene(str(tmp_path / "scene.yaml")).build()
    assert simulation.advance().converged
    assert read_document(tmp_path / "scene.yaml", PARSERS).root.plain()["steps"] == 2


@pytest.mark.parametrize(("content", "always"), FILES)
def test_a_broken_file_is_refused(tmp_path, content, always):
    path = tmp_path / "scene.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
    begin = time.process_time()
    try:
        scene = load_scene(str(path))
        with scene.located():
            _ = scene.build().system
    except InputError as error:
        message = str(error)
    else:
        message = ""
        assert not always, content
    assert time.process_time() - begin < LIMIT
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 4e6  # kB
    if message:
        assert "\n" not in message
        assert str(path) in message
        assert len(message) < 2000


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["cyclic-1", "deep-3", "laughs-1", "bytes_at_random-0", "huge-3", "huge-12", "unknown_name-2"]
)
def test_the_command_says_so_in_one_line_with_status_2(tmp_path, kind):
    content = next(file.values[0] for file in FILES if file.id == kind)
    (tmp_path / "scene.yaml").write_bytes(content if isinstance(content, bytes) else content.encode())
    command = [sys.executable, "-c", "from qlb.cli.main import main; main()", "run", "scene.yaml", "--out", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("error: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert sorted(os.listdir(tmp_path)) == ["scene.yaml"]
    assert Path(tmp_path / "scene.yaml").stat().st_size > 0
