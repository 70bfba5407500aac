"""What a user may write: the public names, with the types that they promise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

import qlb
from qlb.results import Run, RunWriter
from qlb.scenes import Scene, load_scene, scene_schema, scene_yaml


class Tethers(qlb.StencilEnergy):
    """Ties nodes to where they are."""

    def __init__(self, nodes: npt.NDArray[np.int32], places: npt.NDArray[np.float64]) -> None:
        self.stencils = nodes[:, None]
        self.places = places

    def value(self, x: npt.NDArray[np.float64], time: float) -> npt.NDArray[np.float64]:
        return np.asarray(0.5 * np.sum((x[:, 0] - self.places) ** 2, axis=1))

    def gradient(self, x: npt.NDArray[np.float64], time: float) -> npt.NDArray[np.float64]:
        return np.asarray((x[:, 0] - self.places)[:, None])

    def hessian(self, x: npt.NDArray[np.float64], time: float) -> npt.NDArray[np.float64]:
        return np.tile(np.eye(3), (len(x), 1, 1))


def swing(anchors: npt.NDArray[np.float64], time: float) -> npt.NDArray[np.float64]:
    return np.asarray(anchors + np.array([0.0, 0.1 * time, 0.0]))


def one_body() -> float:
    mesh = qlb.TetMesh.box((1, 0.25, 0.25), cells=(4, 1, 1))
    sim = qlb.Simulation(
        mesh,
        material=qlb.StableNeoHookean(young=2e4, poisson=0.49, density=1000),
        fibres=[qlb.Fibres(modulus=1e3, direction=(1, 0, 0))],
        integrator="BDF2",
        solver="QLA",
        step=1e-2,
        gravity=(0, -9.81, 0),
        damping=qlb.Damping(viscosity="1 + x"),
        tolerance=qlb.Tolerance(relative=1e-6),
        solver_settings=qlb.SolverSettings(window=5),
        threads=1,
    )
    sim.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    sim.move(mesh.nodes_where(lambda x: x[:, 0] > 1 - 1e-9), swing, axes="y", until=0.02)
    middle = mesh.nodes_where(lambda x: np.abs(x[:, 0] - 0.5) < 1e-9)
    sim.add(Tethers(middle, mesh.positions[middle]))
    sim.add(qlb.Pressure(mesh.faces_where(lambda x: x[:, 1] > 0.249), qlb.TimeTable([0, 1], [0, 10])))
    iterations = 0
    for result in sim.run(steps=3):
        iterations += result.iterations
        assert result.reason is not qlb.Reason.MAX_ITERATIONS
    lowest: float = result.positions[:, 1].min()
    return lowest + 0.0 * iterations


def several_bodies() -> int:
    placed = qlb.Placement(scale=0.5, rotation=(0, 0, 0.3), translation=(0, 0.5, 0))
    body = qlb.Body(qlb.shapes.box(tets=100), qlb.MooneyRivlin(), placement=placed, velocity=(0, 0, 1), name="box")
    ground = qlb.Plane((0, 0, 0), (0, 1, 0), name="ground", motion=qlb.Translation((0, 0.1, 0)))
    pairs = (qlb.ContactPair(between=("box", "ground"), friction=0.5),)
    sim = qlb.Simulation([body], obstacles=[ground], contact=qlb.Contact(pairs=pairs), threads=1)
    sim.move(sim.nodes_of("box")[:2], qlb.Keyframes([0, 1], [[0, 0, 0], [0, 1, 0]], ease="smooth"))
    count = 0
    for result in sim.run(2):
        if result.contact is not None:
            count += result.contact.count
    return count


def scenes_and_runs(folder: Path) -> float:
    scene: Scene = load_scene("bar", ["mesh.cells=4,1,1", "threads=1"])
    simulation = scene.build()
    with RunWriter(folder / "run", scene.model_dump(mode="json"), simulation) as writer:
        for result in simulation.run(2):
            writer.record(result)
    run = Run(folder / "run")
    (folder / "bar.yaml").write_text(scene_yaml(scene))
    names: list[str] = [str(key) for key in scene_schema()]
    assert "$defs" in names
    return float(run.frame(2).time)


def main(folder: Path) -> None:
    try:
        qlb.StableNeoHookean(young=-1)
    except qlb.InputError as error:
        message: str = str(error)
    assert "young" in message
    assert one_body() < 0
    assert several_bodies() >= 0
    assert abs(scenes_and_runs(folder) - 0.02) < 1e-12
