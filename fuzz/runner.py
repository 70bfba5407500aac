"""What the fuzz targets share: a corpus below build/fuzz, a file to write each input to, the run of Atheris."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

import atheris

ROOT = Path(__file__).parents[1]
MOST_BYTES = 8000


def fuzz(name: str, seeds: dict[str, bytes], words: Iterable[str], target: Callable[[bytes, Path], None]) -> None:
    """Call `target` with inputs, and a path without suffix to write them to, until it raises or the time is up.

    Args:
        name: of the target; `build/fuzz/name` keeps the corpus from run to run, and what was found.
        seeds: inputs to start from, by name.
        words: that inputs are likely to hold.
        target: takes an input as bytes; an exception that leaves it is a finding.
    """
    work = ROOT / "build" / "fuzz" / name
    corpus = work / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    for seed, content in seeds.items():
        (corpus / seed).write_bytes(content)
    plain = sorted({word for word in words if word.isascii() and word.isprintable() and '"' not in word})
    (work / "words").write_text("".join(f'"{word}"\n' for word in plain if "\\" not in word))
    options = [f"-artifact_prefix={work}/", f"-dict={work / 'words'}", f"-max_len={MOST_BYTES}", "-timeout=60"]
    given = sys.argv[1:]
    inputs = [] if any(not option.startswith("-") for option in given) else [str(corpus)]
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what readers print; findings go to standard error
    with tempfile.TemporaryDirectory(prefix="qlb_fuzz_") as folder:
        path = Path(folder) / "input"
        atheris.Setup([sys.argv[0], *options, *given, *inputs], lambda data: target(data, path))
        atheris.Fuzz()
