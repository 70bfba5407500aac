"""The bodies as pictures and videos show them: the rendered surface, coloured by displacement or by body."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from qlb.arrays import FloatArray, IntArray
from qlb.mesh import EmbeddedSurface
from qlb.results import style
from qlb.results.rendering import OVERSAMPLING
from qlb.results.run import Frame, Run

COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0.22, 1.0, 256)), name="displacement")
"""viridis without its darkest end, in which edges and shading would not show."""
OUTLINED = 3.0
"""Sharp edges longer than this, in units of the root of the surface's area, tell a shape: a cube has 4.9."""
_REST = "#9aa5b1"
_MOST_NAMES = 8
_EDGES_BELOW = 20_000
"""So many triangles are shown without their edges."""


@dataclass(frozen=True)
class ShownBodies:
    """The surface of all bodies, and how it is coloured."""

    surface: EmbeddedSurface
    rest: FloatArray
    """[m], shape (v, 3)"""
    body: IntArray
    """of each vertex, shape (v,)"""
    names: tuple[str, ...]
    """of the bodies"""

    @staticmethod
    def of(run: Run) -> ShownBodies:
        """Those of a run."""
        surface, parts = run.mesh.rendered(), run.parts
        body = parts.groups[surface.nodes[:, 0]]
        return ShownBodies(surface, surface.of_nodes(run.mesh.positions), body, parts.body_names)

    def at(self, frame: Frame) -> FloatArray:
        """Where the vertices are in a frame [m], shape (v, 3)."""
        return self.surface.of_nodes(frame.positions)

    @property
    def colours(self) -> list[str]:
        """The colour of each body, where there are several."""
        return [style.LINES[b % len(style.LINES)] for b in range(len(self.names))]

    def displacement(self, x: FloatArray) -> FloatArray:
        """Distance of each vertex at `x` from its place at rest [m], shape (v,)."""
        return np.asarray(np.linalg.norm(x - self.rest, axis=1))

    def add_rest(self, plotter: Any, pyvista: ModuleType) -> None:
        """Show the shape at rest faintly: its sharp edges, or all of it where they are but a few scattered ones."""
        rest = pyvista.PolyData.from_regular_faces(self.rest, self.surface.triangles)
        outline = rest.extract_feature_edges(60, boundary_edges=False, manifold_edges=False)
        if outline.n_points and outline.compute_cell_sizes()["Length"].sum() > OUTLINED * np.sqrt(rest.area):
            plotter.add_mesh(outline, color=_REST, line_width=OVERSAMPLING, lighting=False)
        else:
            plotter.add_mesh(rest, color=_REST, opacity=0.15, lighting=False)

    def add(self, plotter: Any, pyvista: ModuleType, x: FloatArray, largest: float) -> None:
        """Show the bodies at `x` (v, 3) in place of those before; `largest` displacement has the last colour [m]."""
        plotter.add_mesh(
            pyvista.PolyData.from_regular_faces(x, self.surface.triangles),
            name="bodies",
            reset_camera=False,
            render=False,
            **self._scalars(x, largest),
            show_scalar_bar=False,
            show_edges=len(self.surface.triangles) < _EDGES_BELOW,
            edge_color="#1f2933",
            edge_opacity=0.35,
            line_width=0.5 * OVERSAMPLING,
            ambient=0.5,
            diffuse=0.7,
            specular=0.05,
        )

    def _scalars(self, x: FloatArray, largest: float) -> dict[str, Any]:
        """What `add_mesh` is to colour the surface by: displacement, or where there are several the body."""
        if len(self.names) == 1:
            return {"scalars": self.displacement(x), "clim": (0.0, largest), "cmap": COLOURS}
        of_face = self.body[self.surface.triangles[:, 0]]
        return {"scalars": of_face, "clim": (-0.5, len(self.names) - 0.5), "cmap": ListedColormap(self.colours)}

    def add_key(self, figure: Figure, place: tuple[float, float, float, float], largest: float) -> None:
        """What the colours mean, at the foot of a figure: a bar at `place` (left, bottom, width, height, as parts of
        the figure) up to the `largest` displacement [m]; or the names of the first bodies that have one.
        """
        if len(self.names) == 1:
            bar = figure.add_axes(place)
            figure.colorbar(ScalarMappable(Normalize(0, largest), COLOURS), cax=bar, orientation="horizontal")
            bar.set_xlabel("displacement [m]", labelpad=2)
            return
        named = [(name, colour) for name, colour in zip(self.names, self.colours, strict=True) if name][:_MOST_NAMES]
        if named:
            patches = [Patch(color=colour, label=name) for name, colour in named]
            figure.legend(handles=patches, loc="lower center", ncols=len(patches))
