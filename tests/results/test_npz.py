"""What `pack` makes is an npz file to NumPy, and a sound archive to zipfile and unzip."""

from __future__ import annotations

import io
import shutil
import subprocess
import zipfile
import zlib

import numpy as np
import pytest

from qlb.results.npz import pack

ARRAYS = {
    "floats": np.linspace(0, 1, 30).reshape(10, 3),
    "single": np.ones((2, 2), np.float32),
    "by columns": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
    "every second": np.arange(20)[::2],
    "number": np.array(7),
    "nothing": np.empty((0, 3)),
    "texts": np.array([["a", "Grün"], ["", "b"]]),
    "text": np.array(""),
    "solver/flags": np.array([True, False]),
}


@pytest.mark.parametrize("compress", [False, True])
def test_arrays_come_back(tmp_path, compress):
    packed = pack(ARRAYS, compress=compress)
    whole = b"".join(packed.chunks)
    with np.load(io.BytesIO(whole), allow_pickle=False) as arrays:
        assert list(arrays) == list(ARRAYS)
        for name, array in ARRAYS.items():
            assert arrays[name].dtype == array.dtype
            np.testing.assert_array_equal(arrays[name], array, strict=True)
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        assert archive.testzip() is None
        assert {i.filename: i.CRC for i in archive.infolist()} == {f"{n}.npy": c for n, c in packed.crc.items()}
        kinds = {i.compress_type for i in archive.infolist()}
        assert kinds == {zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED}
    (tmp_path / "it.npz").write_bytes(whole)
    if unzip := shutil.which("unzip"):
        assert subprocess.run([unzip, "-tq", "it.npz"], cwd=tmp_path, capture_output=True, check=False).returncode == 0


def test_members_are_those_of_numpy():
    """Byte for byte, so that the CRC-32 is that of any other writer too."""
    file = io.BytesIO()
    np.savez(file, **ARRAYS)
    with zipfile.ZipFile(file) as archive:
        theirs = {name.removesuffix(".npy"): zlib.crc32(archive.read(name)) for name in archive.namelist()}
    by_columns = ("by columns",)  # which are written by rows
    crc = pack(ARRAYS).crc
    assert {n: c for n, c in crc.items() if n not in by_columns} == {
        n: c for n, c in theirs.items() if n not in by_columns
    }


def test_the_same_arrays_make_the_same_bytes():
    assert b"".join(pack(ARRAYS).chunks) == b"".join(pack(dict(ARRAYS)).chunks)


def test_large_arrays_are_not_copied():
    array = np.zeros(100_000)
    chunks = pack({"a": array}).chunks
    assert any(np.shares_memory(np.frombuffer(chunk, np.uint8), array) for chunk in chunks)
