"""Run examples/scenes/* and render a picture of each into docs/images/gallery; needs pyvista and OpenGL.

Arguments: names of scenes (all by default). Runs are kept below runs/gallery, and a finished one is not run again.
"""

import os
import sys
from pathlib import Path

# Else VTK tries, and complains about, the windows of X first.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

from PIL import Image

from qlb.results import Run, render_frames
from qlb.scenes import load_scene
from qlb.studies import run_scene

ROOT = Path(__file__).parents[1]
OUT = ROOT / "docs" / "images" / "gallery"
STEPS = {
    "ball_through_ring": (5, 14, 22, 30),
    "jelly_stack": (5, 17, 33, 100),
    "rocking_table": (10, 20, 60, 120),
    "squeezed_block": (5, 20, 35, 60),
    "twisted_bar": (23, 60, 93, 117),
}
"""The steps that are shown of each."""


def main() -> None:
    """Write the pictures."""
    OUT.mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "examples" / "scenes").iterdir()):
        if sys.argv[1:] and path.stem not in sys.argv[1:]:
            continue
        run, target = finished(path), OUT / f"{path.stem}.png"
        render_frames(run, target, steps=STEPS[path.stem], size=(1300, 620))
        image = Image.open(target).convert("RGB")
        image.quantize(240, dither=Image.Dither.NONE).save(target, optimize=True)


def finished(path: Path) -> Run:
    """The run of a scene file."""
    directory = ROOT / "runs" / "gallery" / path.stem
    if not (directory / "summary.json").is_file() or Run(directory).summary["status"] != "complete":
        run_scene(load_scene(str(path), ["threads=1"]), directory, overwrite=True)
    return Run(directory)


if __name__ == "__main__":
    main()
