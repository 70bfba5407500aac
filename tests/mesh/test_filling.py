"""Surfaces become tets that fill them, whatever is wrong with them, and what is wrong is said."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
import trimesh

import qlb
from qlb import InputError, TetMesh
from qlb.mesh import MeshQuality, cache, filling
from qlb.mesh.geometry import tet_components
from tests.mesh.surfaces import Surface, ball, cube, volume

pytest.importorskip("pytetwild")
EDGE = 0.6
BALL = 4 / 3 * np.pi


@pytest.fixture(scope="module")
def filled() -> TetMesh:
    return TetMesh.from_surface(ball(3), edge=EDGE)


def volume_of(surface: Surface, **arguments: float) -> float:
    return float(TetMesh.from_surface(surface, edge=EDGE, **arguments).volumes().sum())


def test_a_ball_is_filled_within_the_envelope(filled: TetMesh) -> None:
    envelope = filling.ENVELOPE * EDGE
    radii = np.linalg.norm(filled.positions[filled.boundary_triangles()], axis=2)
    assert np.abs(radii - 1).max() < 1.5 * envelope  # the icosphere is not round
    assert filled.volumes().sum() == pytest.approx(BALL, rel=0.1)
    report = filled.report
    assert report is not None
    assert report.notes() == []
    assert report.deviation * np.sqrt(12) < 2 * envelope
    quality = MeshQuality.of(filled)
    assert quality.dihedral[0] > 5
    assert 0.5 * EDGE < quality.edges[1] < 1.2 * EDGE


def test_the_given_surface_lies_in_the_tets_and_follows_them(filled: TetMesh) -> None:
    vertices, triangles = ball(3)
    shown = filled.rendered()
    assert len(shown.triangles) == len(triangles)
    at_rest = shown.of_nodes(filled.positions)
    np.testing.assert_allclose(at_rest[shown.triangles].mean(axis=1), vertices[triangles].mean(axis=1), atol=1e-9)
    swollen = shown.of_nodes(1.5 * filled.positions)
    np.testing.assert_allclose(swollen, 1.5 * at_rest, atol=1e-9)
    assert np.abs(shown.weights).sum(axis=1).max() < 4  # nothing moves much more than the tets do
    plain = TetMesh.from_surface(ball(3), edge=EDGE, surface=False)
    np.testing.assert_array_equal(plain.positions, filled.positions)
    assert plain.surface is None


@pytest.mark.slow
@pytest.mark.parametrize("tets", [600, 4000])
def test_about_as_many_tets_as_asked_for(tets: int) -> None:
    mesh = TetMesh.from_surface(ball(3), tets=tets)
    assert abs(len(mesh.tets) - tets) <= 0.25 * tets
    assert mesh.report is not None
    assert mesh.report.wanted == tets


def _holed() -> Surface:
    vertices, triangles = ball(3)
    return vertices, triangles[np.linalg.norm(vertices[triangles].mean(axis=1) - [0, 0, 1], axis=1) > 0.4]


def _crossing() -> Surface:
    vertices, triangles = ball(3)
    return np.vstack([vertices, vertices + np.array([1.2, 0, 0])]), np.vstack([triangles, triangles + len(vertices)])


def _soup() -> Surface:
    vertices, triangles = ball(3)
    return vertices[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


LENS = np.pi * (2 - 1.2) ** 2 * (1.2**2 + 4 * 1.2) / (12 * 1.2)
"""Volume of what two unit balls at a distance of 1.2 share."""
TROUBLE: dict[str, tuple[Surface, float, str]] = {
    "a hole": (_holed(), BALL, "around 1 hole"),
    "inside out": ((ball(3)[0], ball(3)[1][:, ::-1]), BALL, "1280 triangles turned over"),
    "crossing": (_crossing(), 2 * BALL - LENS, "2 components"),
    "double": ((ball(3)[0], np.vstack([ball(3)[1]] * 2)), BALL, "1280 that are there twice"),
    "soup": (_soup(), BALL, ""),
    "sheet beside": (
        (np.vstack([ball(3)[0], [[3, 0, 0], [4, 0, 0], [3, 1, 0]]]), np.vstack([ball(3)[1], [[642, 643, 644]]])),
        BALL,
        "not filled",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TROUBLE)
def test_what_is_wrong_is_repaired_and_said(name: str, caplog: pytest.LogCaptureFixture) -> None:
    surface, expected, says = TROUBLE[name]
    with caplog.at_level(logging.WARNING, "qlb"):
        mesh = TetMesh.from_surface(surface, edge=EDGE)
    assert mesh.volumes().sum() == pytest.approx(expected, rel=0.12)
    said = [record.getMessage() for record in caplog.records]
    assert any(says in line for line in said) if says else not said
    assert said == (mesh.report.notes() if mesh.report else None)


@pytest.mark.slow
def test_two_bodies_are_two_components() -> None:
    vertices, triangles = ball(2)
    two = np.vstack([vertices, vertices + np.array([3, 0, 0])]), np.vstack([triangles, triangles + len(vertices)])
    mesh = TetMesh.from_surface(two, edge=EDGE)
    assert tet_components(mesh.tets) == 2
    assert mesh.report is not None
    assert mesh.report.components == 2


def test_what_encloses_nothing_is_refused() -> None:
    flat = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), [[0, 1, 2], [0, 2, 3]]
    with pytest.raises(InputError, match="surface encloses no volume: it is flat"):
        TetMesh.from_surface(flat)
    grid = trimesh.creation.icosphere(subdivisions=2)
    cap = np.array(grid.faces)[grid.triangles_center[:, 2] > 0.9]
    with pytest.raises(InputError, match="surface encloses no volume"):
        TetMesh.from_surface((grid.vertices * [1, 1, 0.1], cap), edge=0.3)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"edge": 1.0, "tets": 500}, "either"),
        ({"edge": -1.0}, "edge -1.0 is out of range"),
        ({"edge": float("nan")}, "edge nan"),
        ({"edge": 1e9}, "edge 1000000000.0 is out of range"),
        ({"tets": 3}, "tets 3 is out of range"),
        ({"tets": 600.5}, "tets 600.5"),
    ],
)
def test_arguments_out_of_range_are_refused(arguments: dict[str, float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        TetMesh.from_surface(cube(), **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("surface", "says"),
    [
        ((np.zeros((3, 2)), [[0, 1, 2]]), "must be"),
        ((np.eye(3), [[0, 1, 5]]), "out of range"),
        ((np.eye(3), [[0.0, 1.0, 2.0]]), "integers"),
        ((np.eye(3), np.empty((0, 3), int)), "integers"),
        ((np.eye(3) * np.nan, [[0, 1, 2]]), "vertex 0"),
        (3, "path"),
    ],
)
def test_arrays_that_are_no_surface_are_refused(surface: Surface, says: str) -> None:
    with pytest.raises(InputError, match=says):
        TetMesh.from_surface(surface)


class TestCache:
    @pytest.fixture(autouse=True)
    def own_folder(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self.runs = tmp_path, 0
        monkeypatch.setenv("QLB_CACHE", str(tmp_path))

        def run(task: filling._Task, share: float) -> TetMesh:
            self.runs += 1
            return TetMesh.box((1, 1, 1), cells=(2, 2, 2))

        monkeypatch.setattr(filling._Task, "run", run)

    def fill(self, side: float = 1.0, **arguments: float) -> TetMesh:
        return TetMesh.from_surface(cube(side), **{"edge": 0.5, **arguments})  # type: ignore[arg-type]

    def test_the_same_surface_and_settings_are_filled_once(self) -> None:
        first, second = self.fill(), self.fill()
        assert self.runs == 1
        np.testing.assert_array_equal(first.positions, second.positions)
        assert first.surface is not None
        assert second.surface is not None
        np.testing.assert_array_equal(first.surface.weights, second.surface.weights)
        assert first.report == second.report
        self.fill(edge=0.6)
        self.fill(side=1.1)
        assert self.runs == 3

    @pytest.mark.parametrize("damage", [lambda b: b[:-40], lambda b: b"", lambda b: b[:200] + b"x" + b[201:]])
    def test_a_damaged_entry_is_made_again(self, damage: object) -> None:
        self.fill()
        [entry] = self.folder.iterdir()
        entry.write_bytes(damage(entry.read_bytes()))  # type: ignore[operator]
        self.fill()
        self.fill()
        assert self.runs == 2
        assert [path.name for path in self.folder.iterdir()] == [entry.name]

    def test_another_program_s_entry_is_made_again(self) -> None:
        self.fill()
        [entry] = self.folder.iterdir()
        cache.store(entry.stem, {"positions": np.zeros((3, 3)), "tets": np.zeros((1, 4), int)})
        self.fill()
        assert self.runs == 2

    def test_it_can_be_switched_off_and_need_not_be_writable(self, monkeypatch: pytest.MonkeyPatch) -> None:
        for place in ("0", "/proc/nowhere"):
            monkeypatch.setenv("QLB_CACHE", place)
            self.fill()
            self.fill()
        assert self.runs == 4
        assert list(self.folder.iterdir()) == []

    def test_it_lies_where_the_system_wants_it(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("QLB_CACHE")
        monkeypatch.setenv("XDG_CACHE_HOME", "/some/where")
        assert cache.folder() == Path("/some/where/qlb")
        monkeypatch.delenv("XDG_CACHE_HOME")
        monkeypatch.setenv("HOME", "/home/me")
        assert cache.folder() == Path("/home/me/.cache/qlb")


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from qlb.errors import MissingExtra
    from qlb.mesh import files

    monkeypatch.setattr(filling, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"qlb\[mesh\]"):
        TetMesh.from_surface(cube(), edge=0.44)
    monkeypatch.setattr(files, "find_spec", lambda name: None)
    (tmp_path / "x.usda").write_text("#usda 1.0")
    with pytest.raises(MissingExtra, match=r"qlb\[usd\]"):
        qlb.mesh.read_surface(tmp_path / "x.usda")


def test_load_takes_tets_and_surfaces(tmp_path: Path) -> None:
    mesh = TetMesh.box((1, 1, 1), cells=(2, 2, 2))
    mesh.write(tmp_path / "box.msh")
    np.testing.assert_array_equal(TetMesh.load(tmp_path / "box.msh", tets=5000).tets, mesh.tets)
    trimesh.Trimesh(*ball(3), process=False).export(tmp_path / "ball.stl")
    filled = TetMesh.load(tmp_path / "ball.stl", edge=EDGE)
    assert filled.report is not None
    assert filled.report.name == "ball.stl"
    assert volume(filled.rendered().of_nodes(filled.positions), filled.rendered().triangles) == pytest.approx(
        BALL, rel=0.02
    )
