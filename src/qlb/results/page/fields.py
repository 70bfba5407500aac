"""What a surface can be coloured by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from qlb.arrays import FloatArray
from qlb.results.page.packing import Quantised
from qlb.results.run import Frame, Run

_OUTLIERS = 0.005
"""The part of the values that may lie above the colour range, where it makes the range at most half as long."""


@dataclass(frozen=True)
class NodalField:
    """A number at each node of the bodies, in every frame."""

    name: str
    label: str
    unit: str
    values: Callable[[Frame], FloatArray]
    """of a frame, shape (n,)"""


def nodal_fields(run: Run) -> list[NodalField]:
    """Those that a run has, beside the displacement, which the page takes from the positions."""
    n = len(run.mesh.positions)
    fields = [NodalField("speed", "Speed", "m/s", lambda frame: _norms(frame.velocities[:n]))]
    if run.summary.get("contact") is not None:
        force = NodalField("contact_force", "Contact force on a node", "N", lambda frame: _contact_force(frame, n))
        fields.append(force)
    return fields


def _norms(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _contact_force(frame: Frame, nodes: int) -> FloatArray:
    return np.zeros(nodes) if frame.contact_forces is None else _norms(frame.contact_forces[:nodes])


def field_data(field: NodalField, values: Sequence[FloatArray]) -> dict[str, Any]:
    """A field on the vertices, of frames each (v,), in 8 bits between 0 and a value that few others exceed."""
    rows = np.stack(values)
    largest = float(rows.max(initial=0.0))
    common = float(np.quantile(rows, 1 - _OUTLIERS)) if rows.size else 0.0
    high = common if 0 < 2 * common < largest else largest
    return Quantised.of(rows, 0.0, high, bits=8).data() | {"name": field.name, "largest": largest}
