"""VTU and PVD: a file for each frame that any version of ParaView and most other tools read."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

from qlb.export.format import Format, frame_file, frame_files
from qlb.export.grids import Grid, Sample, grids
from qlb.export.recording import Recording
from qlb.results import WriteError
from qlb.results.files import replacing, write_text


def write_vtu(recording: Recording, path: Path, *, volume: bool = True) -> list[Path]:
    """Write `path` NAME.pvd, which lists the frames, and those to the folder NAME beside it: NAME/bodies_000012.vtu.

    Each file holds its cells anew, as the format knows no reference to another file; but what stands still, such as
    the ground, is written once. Positions are float64, fields float32 (see `qlb.export.grids`).

    Args:
        recording: the frames.
        path: the PVD file.
        volume: write the tets with stress; else the rendered surface.

    Raises:
        InputError: a frame is damaged.
        WriteError: a file could not be written.
    """
    parts, folder = grids(recording, volume=volume), pieces_folder(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WriteError(folder, error.strerror or str(error)) from None
    files, rows = [path], []
    first = recording.steps[0]
    for frame in recording.frames():
        for number, grid in enumerate(parts):
            written = frame_file(folder / f"{grid.name}.vtu", frame.step if grid.moves else first)
            if grid.moves or frame.step == first:
                _write_piece(written, grid, grid.at(frame))
                files.append(written)
            where = quoteattr(written.relative_to(path.parent).as_posix())
            rows.append(f'<DataSet timestep="{frame.time!r}" part="{number}" name="{grid.name}" file={where}/>')
    text = "\n    ".join(rows)
    write_text(path, f'<?xml version="1.0"?>\n{_OPEN}\n  <Collection>\n    {text}\n  </Collection>\n</VTKFile>\n')
    return files


_OPEN = '<VTKFile type="Collection" version="0.1">'


def pieces_folder(path: Path) -> Path:
    """Where the frames of the list `path` go."""
    return path.with_suffix("")


def _write_piece(path: Path, grid: Grid, sample: Sample) -> None:
    import meshio

    cell_data = {name: [values] for name, values in (grid.fixed | sample.cell_data).items()}
    mesh = meshio.Mesh(sample.points, [(grid.cell_type, grid.cells)], sample.point_data, cell_data)
    with replacing(path) as temporary:
        meshio.write(temporary, mesh, "vtu", binary=True, compression="zlib")


def _files(path: Path) -> list[Path]:
    folder = pieces_folder(path)
    return [
        path,
        *(file for name in ("bodies", "surface", "surroundings") for file in frame_files(folder / f"{name}.vtu")),
    ]


FORMAT = Format(
    "vtu", "ParaView and VTK of any age: a file a frame", (".pvd",), write_vtu, options=("volume",), files=_files
)
