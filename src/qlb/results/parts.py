"""What a run is made of, as mesh.npz keeps it: bodies, obstacles, planes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.bodies import Assembly
from qlb.errors import InputError
from qlb.mesh import EmbeddedSurface, TetMesh
from qlb.results.files import Arrays, read_arrays


@dataclass(frozen=True)
class Parts:
    """Bodies, obstacles and planes at rest. Nodes are those of the bodies (n), then those of the obstacles (q)."""

    mesh: TetMesh
    """all bodies"""
    groups: IntArray
    """body or obstacle of each node, shape (n + q,): bodies from 0, then obstacles"""
    body_names: tuple[str, ...]
    obstacle_names: tuple[str, ...]
    obstacle_vertices: FloatArray
    """[m], shape (q, 3)"""
    obstacle_triangles: IntArray
    """node indices from n on, shape (t, 3)"""
    planes: FloatArray
    """point [m] and unit normal out of the solid, shape (p, 6)"""

    @property
    def nodes(self) -> int:
        """n + q."""
        return len(self.groups)

    @property
    def bodies(self) -> int:
        """How many there are."""
        return len(self.body_names)

    @staticmethod
    def of(assembly: Assembly) -> Parts:
        """Those of a simulation."""
        rows = [(*plane.point, *plane.normal) for plane in assembly.planes]
        return Parts(
            mesh=assembly.mesh,
            groups=assembly.groups,
            body_names=tuple(body.name for body in assembly.bodies),
            obstacle_names=tuple(obstacle.name for obstacle in assembly.obstacles),
            obstacle_vertices=assembly.system_mesh.positions[assembly.body_nodes :],
            obstacle_triangles=assembly.obstacle_triangles,
            planes=np.reshape(rows, (-1, 6)).astype(np.float64),
        )

    def arrays(self) -> Arrays:
        """Named arrays that `read` takes; what a run of one body alone does not need is left out."""
        arrays: Arrays = {"positions": self.mesh.positions, "tets": self.mesh.tets}
        if self.nodes > len(self.mesh.positions) or self.bodies > 1:
            arrays |= {"groups": self.groups, "body_names": np.array(self.body_names, np.str_)}
        if (surface := self.mesh.surface) is not None:
            arrays |= {"surface_triangles": surface.triangles}
            arrays |= {"surface_tets": surface.tets, "surface_weights": surface.weights}
        if len(self.obstacle_triangles):
            arrays |= {"obstacle_names": np.array(self.obstacle_names, np.str_)}
            arrays |= {"obstacle_vertices": self.obstacle_vertices, "obstacle_triangles": self.obstacle_triangles}
        return arrays | ({"planes": self.planes} if len(self.planes) else {})

    @staticmethod
    def read(path: Path) -> Parts:
        """Read a mesh.npz. Raises `InputError` where it is missing, damaged or does not fit together."""
        arrays = read_arrays(path, {"positions": (None, 3), "tets": (None, 4)})
        mesh = TetMesh(arrays["positions"], arrays["tets"])
        several = "groups" in arrays
        vertices = arrays.get("obstacle_vertices", np.empty((0, 3)))
        nodes = len(mesh.positions) + len(vertices)
        shapes: dict[str, tuple[int | None, ...]] = {"groups": (nodes,), "body_names": (None,)} if several else {}
        if len(vertices):
            shapes |= {"obstacle_names": (None,), "obstacle_vertices": (None, 3), "obstacle_triangles": (None, 3)}
        shapes |= {"planes": (None, 6)} if "planes" in arrays else {}
        if "surface_triangles" in arrays:
            shapes |= {"surface_triangles": (None, 3), "surface_tets": (None,), "surface_weights": (None, 4)}
        arrays = read_arrays(path, shapes)
        if "surface_triangles" in arrays:
            faces, owners = (arrays[name].astype(np.int64) for name in ("surface_triangles", "surface_tets"))
            mesh = mesh.with_surface(EmbeddedSurface.on(mesh, faces, owners, arrays["surface_weights"]))
        triangles = arrays.get("obstacle_triangles", np.empty((0, 3))).astype(np.int32)
        if len(triangles) and (triangles.min() < len(mesh.positions) or triangles.max() >= nodes):
            raise InputError(f"{path} is not what it should be: 'obstacle_triangles' name nodes that are no obstacle's")
        return Parts(
            mesh=mesh,
            groups=arrays.get("groups", np.zeros(nodes)).astype(np.int32),
            body_names=tuple(map(str, arrays.get("body_names", [""]))),
            obstacle_names=tuple(map(str, arrays.get("obstacle_names", []))),
            obstacle_vertices=vertices,
            obstacle_triangles=triangles,
            planes=arrays.get("planes", np.empty((0, 6))),
        )
