"""Benchmarks, run by `python -m benchmarks` (or `make bench`) from the root of the repository."""

import os
from pathlib import Path

# Before anything loads OpenBLAS, which takes processors newer than itself for the oldest there are: CHOLMOD over it
# would then run at a third of its speed, and be no rival.
_PROCESSOR = Path("/proc/cpuinfo")
if _PROCESSOR.exists() and "avx512f" in _PROCESSOR.read_text():
    os.environ.setdefault("OPENBLAS_CORETYPE", "SkylakeX")
