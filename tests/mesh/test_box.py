"""Meshes of boxes: counts, volumes, faces that fit, symmetry."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from qlb import InputError, TetMesh

SIZE = (1.0, 0.6, 0.4)
CELLS = [(1, 1, 1), (2, 1, 1), (3, 1, 2), (3, 3, 3), (2, 4, 2), (5, 2, 3), (20, 5, 5)]


@pytest.fixture(params=CELLS, ids=str)
def cells(request: pytest.FixtureRequest) -> tuple[int, int, int]:
    return request.param


@pytest.fixture
def mesh(cells: tuple[int, int, int]) -> TetMesh:
    return TetMesh.box(SIZE, cells=cells)


def test_counts(mesh: TetMesh, cells: tuple[int, int, int]) -> None:
    assert len(mesh.tets) == 6 * np.prod(cells)
    assert len(mesh.positions) == np.prod(np.array(cells) + 1)


def test_types_are_those_that_the_kernels_take(mesh: TetMesh) -> None:
    assert mesh.positions.dtype == np.float64
    assert mesh.tets.dtype == np.int32
    assert mesh.positions.flags.c_contiguous
    assert mesh.tets.flags.c_contiguous


def test_box_spans_from_the_origin_to_its_size(mesh: TetMesh) -> None:
    np.testing.assert_array_equal(mesh.positions.min(axis=0), 0.0)
    np.testing.assert_array_equal(mesh.positions.max(axis=0), SIZE)


def test_every_tet_is_a_sixth_of_its_cell_and_positive(mesh: TetMesh, cells: tuple[int, int, int]) -> None:
    np.testing.assert_allclose(mesh.volumes(), np.prod(SIZE) / np.prod(cells) / 6, rtol=1e-12)


def test_neighbours_share_whole_faces(mesh: TetMesh) -> None:
    faces = Counter(tuple(sorted(face)) for tet in mesh.tets.tolist() for face in combinations(tet, 3))
    assert set(faces.values()) <= {1, 2}
    # A face that is not shared lies in one of the six sides of the box: nowhere else is there a gap.
    for face, count in faces.items():
        corners = mesh.positions[list(face)]
        on_a_side = any((corners[:, k] == end).all() for k in range(3) for end in (0.0, SIZE[k]))
        assert (count == 1) == on_a_side


def test_each_boundary_square_is_two_triangles(mesh: TetMesh, cells: tuple[int, int, int]) -> None:
    a, b, c = cells
    assert len(mesh.boundary_triangles()) == 4 * (a * b + b * c + c * a)


def test_no_tet_is_listed_twice(mesh: TetMesh) -> None:
    assert len({tuple(sorted(tet)) for tet in mesh.tets.tolist()}) == len(mesh.tets)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("cells", [(2, 2, 2), (4, 2, 6)], ids=str)
def test_an_even_box_is_its_own_mirror_image(axis: int, cells: tuple[int, int, int]) -> None:
    mesh = TetMesh.box(SIZE, cells=cells)
    mirrored = mesh.positions.copy()
    mirrored[:, axis] = SIZE[axis] - mirrored[:, axis]
    distance = np.linalg.norm(mirrored[:, None] - mesh.positions[None], axis=2)
    image = distance.argmin(axis=1)
    np.testing.assert_allclose(distance.min(axis=1), 0.0, atol=1e-15)
    tets = {tuple(sorted(tet)) for tet in mesh.tets.tolist()}
    assert {tuple(sorted(tet)) for tet in image[mesh.tets].tolist()} == tets


def test_neighbouring_cells_are_mirror_images() -> None:
    mesh = TetMesh.box((2.0, 1.0, 1.0), cells=(2, 1, 1))
    centres = mesh.positions[mesh.tets].mean(axis=1)
    left, right = centres[:6], centres[6:]
    np.testing.assert_allclose(
        np.sort((right * [-1, 1, 1] + [2, 0, 0]).round(12), axis=0), np.sort(left.round(12), axis=0)
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"size": (1, 0, 1)}, "box size (1, 0, 1) is out of range: three lengths > 0 m"),
        ({"size": (1, -2, 1)}, "box size (1, -2, 1) is out of range: three lengths > 0 m"),
        ({"size": (1, float("nan"), 1)}, "box size (1, nan, 1) is out of range: three lengths > 0 m"),
        ({"size": (1, float("inf"), 1)}, "box size (1, inf, 1) is out of range: three lengths > 0 m"),
        ({"size": (1, 1)}, "box size (1, 1) is out of range: three lengths > 0 m"),
        ({"cells": (1, 0, 1)}, "box cells (1, 0, 1) are out of range: three whole numbers >= 1"),
        ({"cells": (1, 2.5, 1)}, "box cells (1, 2.5, 1) are out of range: three whole numbers >= 1"),
        ({"cells": (1, 1)}, "box cells (1, 1) are out of range: three whole numbers >= 1"),
        ({"cells": (1, float("nan"), 1)}, "box cells (1, nan, 1) are out of range: three whole numbers >= 1"),
        ({"cells": (1, float("inf"), 1)}, "box cells (1, inf, 1) are out of range: three whole numbers >= 1"),
    ],
)
def test_wrong_sizes_and_counts_are_named(arguments: dict[str, tuple[float, ...]], message: str) -> None:
    with pytest.raises(InputError) as caught:
        TetMesh.box(**arguments)  # type: ignore[arg-type]
    assert str(caught.value) == message
