"""VTKHDF 2.0: all frames in one HDF5 file, the cells stored once; for ParaView from 5.12 on. Needs h5py."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from qlb.errors import MissingExtra
from qlb.export.forgiving_file import ForgivingFile
from qlb.export.format import Format
from qlb.export.grids import Data, Grid, grids
from qlb.export.recording import Recording
from qlb.results.files import replacing

_VERSION = (2, 0)
_TYPES = {"triangle": 5, "tetra": 10}
_STORED = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


def write_vtkhdf(recording: Recording, path: Path, *, volume: bool = True) -> list[Path]:
    """Write the bodies to `path`, and obstacles and planes, where there are any, to NAME-surroundings.vtkhdf beside it.

    Positions are float64, fields float32 (see `qlb.export.grids`); what does not change is stored once.

    Args:
        recording: the frames.
        path: the file.
        volume: write the tets with stress; else the rendered surface.

    Raises:
        InputError: a frame is damaged.
        MissingExtra: h5py is not installed.
        WriteError: a file could not be written.
    """
    h5py, files = _import_h5py(), list[Path]()
    for grid in grids(recording, volume=volume):
        target = path if not files else surroundings(path)
        files.append(target)
        with replacing(target) as temporary, ForgivingFile(temporary) as file:
            with h5py.File(file, "w") as document:
                _write(h5py, document.create_group("VTKHDF"), grid, recording, file)
            file.check()
    return files


def surroundings(path: Path) -> Path:
    """Where obstacles and planes go."""
    return path.with_name(f"{path.stem}-surroundings{path.suffix}")


def _write(h5py: ModuleType, root: Any, grid: Grid, recording: Recording, file: ForgivingFile) -> None:
    """The layout is that of https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format ."""
    kind = b"UnstructuredGrid"
    root.attrs["Version"] = np.array(_VERSION, np.int64)
    root.attrs.create("Type", kind, dtype=h5py.string_dtype("ascii", len(kind)))
    cells, corners = grid.cells.shape
    root["Connectivity"] = grid.cells.astype(np.int64).ravel()
    root["Offsets"] = np.arange(0, grid.cells.size + 1, corners, dtype=np.int64)
    root["Types"] = np.full(cells, _TYPES[grid.cell_type], np.uint8)
    root["NumberOfCells"] = np.array([cells], np.int64)
    root["NumberOfConnectivityIds"] = np.array([grid.cells.size], np.int64)
    series = _Series(root, len(recording.steps))
    for name, values in grid.fixed.items():
        series.put("CellData", name, values)
    times = np.empty(len(recording.steps))
    frames = recording.read() if grid.name == "surroundings" else recording.frames()
    for k, frame in enumerate(frames):
        times[k] = frame.time
        file.check()
        if k > 0 and not grid.moves:
            continue
        sample = grid.at(frame)
        series.append(k, "", {"Points": sample.points})
        series.append(k, "PointData", sample.point_data)
        series.append(k, "CellData", sample.cell_data)
    root["NumberOfPoints"] = np.array([len(root["Points"]) // series.frames_of("Points")], np.int64)
    series.finish(times)


class _Series:
    """Arrays of the frames behind each other, and where each begins."""

    def __init__(self, root: Any, frames: int) -> None:
        self._root, self._frames = root, frames
        self._rows: dict[str, int] = {}
        """of one frame, by the path of the array; 0 for those that stay"""
        self._written: dict[str, int] = {}

    def put(self, group: str, name: str, values: Any) -> None:
        """An array that stays."""
        self._root[f"{group}/{name}"] = values
        self._rows[f"{group}/{name}"] = 0

    def append(self, k: int, group: str, data: Data) -> None:
        """Arrays of frame `k`."""
        for name, values in data.items():
            key = f"{group}/{name}" if group else name
            if k == 0:
                rest = values.shape[1:]
                self._root.create_dataset(
                    key, shape=(0, *rest), maxshape=(None, *rest), chunks=values.shape, dtype=values.dtype, **_STORED
                )
                self._rows[key] = len(values)
            stored = self._root[key]
            stored.resize((k + 1) * len(values), axis=0)
            stored[k * len(values) :] = values
            self._written[key] = k + 1

    def frames_of(self, key: str) -> int:
        """How many frames an array holds: one where it stays."""
        return self._written[key]

    def finish(self, times: Any) -> None:
        """Write where in each array each frame begins."""
        steps = self._root.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(self._frames)
        steps["Values"] = times
        steps["PartOffsets"] = np.zeros(self._frames, np.int64)
        steps["NumberOfParts"] = np.ones(self._frames, np.int64)
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros((self._frames, 1), np.int64)
        for key, rows in self._rows.items():
            moving = self._written.get(key, 1) > 1
            offsets = np.arange(self._frames, dtype=np.int64) * (rows if moving else 0)
            group, _, name = key.rpartition("/")
            steps[f"{group}Offsets/{name}" if group else "PointOffsets"] = offsets


def _import_h5py() -> ModuleType:
    try:
        import h5py
    except ImportError as error:
        raise MissingExtra(f'the format vtkhdf needs h5py: pip install "qlb[vtkhdf]" ({error})') from None
    module: ModuleType = h5py
    return module


FORMAT = Format(
    "vtkhdf",
    "ParaView 5.12 or newer: all frames in one file",
    (".vtkhdf",),
    write_vtkhdf,
    options=("volume",),
    files=lambda path: [path, surroundings(path)],
)
