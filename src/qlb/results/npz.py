"""npz files in a few system calls: what `numpy.savez` spends on a small array costs more than its bytes.

A ZIP archive with one .npy file for each array, all sizes in ZIP64 fields: PKWARE, ".ZIP File Format Specification"
6.3.10, sections 4.3.7, 4.3.12, 4.3.14 to 4.3.16 and 4.5.3.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from io import BytesIO
from typing import Any, NamedTuple
from zlib import DEFLATED, MAX_WBITS, compressobj, crc32

import numpy as np
import numpy.typing as npt

SUFFIX = ".npy"
_VERSION = 45
_UTF8 = 0x800
_DATE = 33
"""1 January 1980, so that the same arrays make the same file"""
_IN_EXTRA = 0xFFFFFFFF
_ZIP64 = 1


class Packed(NamedTuple):
    """An npz file that is to be written."""

    chunks: list[bytes | memoryview]
    """its bytes in order; large arrays are not copied"""
    crc: dict[str, int]
    """CRC-32 of each array as the archive holds it"""


def pack(arrays: Mapping[str, npt.ArrayLike], *, compress: bool = False) -> Packed:
    """Named arrays as an npz file, deflated or stored."""
    chunks: list[bytes | memoryview] = []
    directory, crc, offset = b"", {}, 0
    for name, array in arrays.items():
        body = _npy(np.asarray(array, order="C"))
        size = sum(map(len, body))
        crc[name] = crc32(body[1], crc32(body[0]))
        if compress:
            deflate = compressobj(method=DEFLATED, wbits=-MAX_WBITS)
            body = [deflate.compress(body[0]), deflate.compress(body[1]), deflate.flush()]
        stored = sum(map(len, body))
        file = (name + SUFFIX).encode()
        facts = struct.pack("<5H", _VERSION, _UTF8, DEFLATED if compress else 0, 0, _DATE)
        facts += struct.pack("<3LH", crc[name], _IN_EXTRA, _IN_EXTRA, len(file))
        header = b"PK\3\4" + facts + struct.pack("<H", 20) + file + struct.pack("<2H2Q", _ZIP64, 16, size, stored)
        directory += b"PK\1\2" + struct.pack("<H", _VERSION) + facts + struct.pack("<4H2L", 28, 0, 0, 0, 0, _IN_EXTRA)
        directory += file + struct.pack("<2H3Q", _ZIP64, 24, size, stored, offset)
        chunks += [header, *body]
        offset += len(header) + stored
    return Packed([*chunks, directory + _end(len(crc), len(directory), offset)], crc)


def _npy(array: npt.NDArray[Any]) -> list[bytes | memoryview]:
    """Header and data of a .npy file."""
    header = BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(array))
    return [header.getvalue(), array.reshape(-1).view(np.uint8).data]


def _end(members: int, size: int, offset: int) -> bytes:
    """What follows the directory of an archive, which has that size and begins at that offset."""
    end64 = b"PK\6\6" + struct.pack("<Q2H2L4Q", 44, _VERSION, _VERSION, 0, 0, members, members, size, offset)
    locator = b"PK\6\7" + struct.pack("<LQL", 0, offset + size, 1)
    return end64 + locator + b"PK\5\6" + struct.pack("<4H2LH", 0, 0, 0xFFFF, 0xFFFF, _IN_EXTRA, _IN_EXTRA, 0)
