"""Installs a wheel into a new virtual environment, runs it, and holds it against the build in this environment.

    .venv/bin/python scripts/check_wheel.py dist/qlb-*.whl

Fails unless the libraries that the wheel brings are those that are loaded, the scripts of reports and all licences
are in it, and a run gives the same bits.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

import numpy as np

RUN = ["run", "bar", "--steps", "10", "--threads", "1", "--no-picture", "--out"]
MAPS = """
import qlb, pathlib
libraries = {line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}
print(*sorted(path for path in libraries if "metis" in path or "gomp" in path or "_native" in path), sep="\\n")
"""


def main(wheel: Path) -> None:
    """Check one wheel; exits with a message where something is wrong."""
    names = zipfile.ZipFile(wheel).namelist()
    for part in ("static/viewer.js", "static/plots.js", "licenses/LICENSE", "metis.txt", "libgomp.txt", "nanobind.txt"):
        _require(any(name.endswith(part) for name in names), f"{part} is not in {wheel.name}")
    with tempfile.TemporaryDirectory() as folder:
        clean = Path(folder)
        venv.create(clean / "venv", with_pip=True)
        python = clean / "venv" / "bin" / "python"
        environment = {"PATH": str(python.parent), "HOME": folder}
        _run([python, "-m", "pip", "install", "--quiet", wheel.resolve()], clean, environment)
        loaded = _run([python, "-c", MAPS], clean, environment).split()
        _require(len(loaded) >= 3, f"not all libraries are loaded: {loaded}")
        foreign = [path for path in loaded if not path.startswith(folder)]
        _require(not foreign, f"loaded from the system: {foreign}")
        print(_run([python.parent / "qlb", "doctor"], clean, environment))
        print(_run([python.parent / "qlb", *RUN, "wheel"], clean, environment))
        _run([Path(sys.executable).parent / "qlb", *RUN, clean / "source"], clean, None)
        frames = [np.load(clean / name / "frames" / "000010.npz") for name in ("wheel", "source")]
        _require(np.array_equal(frames[0]["positions"], frames[1]["positions"]), "the wheel gives other bits")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, the same bits as this environment's build")


def _run(command: list[object], folder: Path, environment: dict[str, str] | None) -> str:
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    _require(done.returncode == 0, f"{command}: exit status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def _require(ok: bool, problem: str) -> None:
    if not ok:
        sys.exit(problem)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
