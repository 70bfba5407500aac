"""What a table of timings must say about where it was made."""

from __future__ import annotations

import platform
from datetime import date
from pathlib import Path

import qlb
from qlb import _native


def machine_line(threads: int) -> str:
    """Processor, SIMD level, threads, versions and date in one line."""
    libraries = _native.libraries()
    return (
        f"{_processor()}, {_native.simd_levels()[-1]}, {threads} thread{'s' if threads > 1 else ''};"
        f" qlb {qlb.__version__}, CHOLMOD {_native.cholmod_version}, {' '.join(_native.openblas_version.split()[:2])},"
        f" gcc {libraries['compiler']}, Python {platform.python_version()}; {date.today().isoformat()}"
    )


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def markdown(header: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
