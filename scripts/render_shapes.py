"""Render docs/images/shapes.png: every shape of the package, as meshed; needs pyvista and OpenGL."""

import os
import sys
from pathlib import Path

# Else VTK tries, and complains about, the windows of X first.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import numpy as np
import pyvista
from PIL import Image

import qlb

OUT = Path(__file__).parents[1] / "docs" / "images" / "shapes.png"
ROWS = [
    [("bunny", "#c9b6a4", 8000), ("duck", "#f2c230", 8000), ("armadillo", "#a9b18f", 8000)],
    [("ball", "#7fa8c9", 3000), ("shell", "#c98f7f", 6000), ("torus", "#9fc98f", 3000), ("cylinder", "#b79fc9", 3000)],
]
LOOK_FROM = np.array([0.75, 0.38, 0.95]) / np.linalg.norm([0.75, 0.38, 0.95])
WIDTH, HEIGHTS, OVERSAMPLING = 1200, (430, 250), 2


def main() -> None:
    """Write the picture to the first argument, or into the docs."""
    rows = []
    for shapes, height in zip(ROWS, HEIGHTS, strict=True):
        size = (OVERSAMPLING * WIDTH // len(shapes), OVERSAMPLING * height)
        rows.append(np.concatenate([render(*shape, size) for shape in shapes], axis=1))
    image = Image.fromarray(np.concatenate(rows))
    image = image.resize((image.width // OVERSAMPLING, image.height // OVERSAMPLING), Image.Resampling.LANCZOS)
    image.quantize(96, dither=Image.Dither.NONE).save(sys.argv[1] if len(sys.argv) > 1 else OUT, optimize=True)


def render(name: str, colour: str, tets: int, size: tuple[int, int]) -> np.ndarray:
    """One shape, shape (height, width, 3); hollow ones are cut open."""
    mesh = qlb.shapes.SHAPES[name](tets=tets)
    centres = mesh.centroids()
    shown = mesh.tets if name != "shell" else mesh.tets[(centres[:, 0] < 0) | (centres[:, 2] < 0)]
    cells = np.column_stack([np.full(len(shown), 4), shown])
    grid = pyvista.UnstructuredGrid(cells, np.full(len(shown), pyvista.CellType.TETRA), mesh.positions)
    plotter = pyvista.Plotter(off_screen=True, window_size=size, lighting="light kit")
    plotter.set_background("white")
    plotter.add_mesh(
        grid.extract_surface(algorithm="dataset_surface"),
        color=colour,
        show_edges=True,
        edge_color="#333b44",
        edge_opacity=0.5,
        line_width=1.2,
        ambient=0.35,
        diffuse=0.75,
    )
    right = np.cross((0.0, 1.0, 0.0), LOOK_FROM) / np.linalg.norm(np.cross((0.0, 1.0, 0.0), LOOK_FROM))
    axes = np.stack([right, np.cross(LOOK_FROM, right), LOOK_FROM])
    low, high = (mesh.positions @ axes.T).min(axis=0), (mesh.positions @ axes.T).max(axis=0)
    middle, reach = 0.5 * (low + high) @ axes, float(np.linalg.norm(high - low))
    plotter.camera.focal_point = tuple(middle)
    plotter.camera.position = tuple(middle + 3 * reach * LOOK_FROM)
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.54 * max(high[1] - low[1], (high[0] - low[0]) * size[1] / size[0])
    plotter.camera.clipping_range = (reach, 6 * reach)
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


if __name__ == "__main__":
    main()
