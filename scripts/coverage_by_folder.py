"""Prints line coverage by folder, and in all, from the summaries of coverage.py and of gcovr."""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def lines(summary: dict[str, Any]) -> Iterator[tuple[Path, int, int]]:
    """Files, how many lines of each the tests reach, and how many it has."""
    if "totals" in summary:  # coverage.py
        for name, file in summary["files"].items():
            yield Path(name), file["summary"]["covered_lines"], file["summary"]["num_statements"]
    else:
        for file in summary["files"]:
            yield Path(file["filename"]), file["line_covered"], file["line_total"]


def main() -> None:
    """Print a table for each summary."""
    for name in sys.argv[1:]:
        folders: dict[str, list[int]] = defaultdict(lambda: [0, 0])
        for path, covered, total in lines(json.loads(Path(name).read_text())):
            for folder in (str(path.parent), f"all of {Path(name).stem}"):
                folders[folder][0] += covered
                folders[folder][1] += total
        for folder, (covered, total) in sorted(folders.items(), key=lambda item: (item[0].startswith("all"), item[0])):
            print(f"{folder:32} {covered:6} of {total:6} lines {100 * covered / max(total, 1):6.1f} %")
        print()


if __name__ == "__main__":
    main()
