"""What a surface can be coloured by."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from qlb.analysis import Energies, Snapshot
from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.results.page.packing import Quantised, numbers
from qlb.results.run import Run

_OUTLIERS = 0.005
"""The part of the values that may lie above the colour range, where it makes the range at most half as long."""


@dataclass(frozen=True)
class NodalField:
    """A number at each node of the bodies, in every frame."""

    name: str
    label: str
    unit: str
    values: Callable[[Snapshot], FloatArray]
    """of a frame, shape (n,)"""


def nodal_fields(run: Run) -> tuple[list[NodalField], str]:
    """Those that a run has, beside the displacement, which the page takes from the positions; and why not more."""
    fields = [NodalField("speed", "Speed", "m/s", lambda now: _norms(now.velocities, now))]
    reason = _no_stress(run)
    if not reason:
        fields += [
            NodalField(
                "energy_density", "Strain energy density", "J/m\u00b3", lambda now: now.at_nodes(now.energy_density)
            ),
            NodalField("von_mises", "von Mises stress", "Pa", lambda now: now.at_nodes(now.von_mises_stress)),
        ]
    if run.summary.get("contact") is not None:
        fields.append(
            NodalField("contact_force", "Contact force on a node", "N", lambda now: _norms(now.contact_forces, now))
        )
    return fields, reason


def _no_stress(run: Run) -> str:
    """Why stress and energies are not known, or nothing."""
    try:
        first = run.snapshot(run.frame_steps[0])
        _ = first.energies
    except InputError as error:
        return str(error)
    return ""


def _norms(vectors: FloatArray, now: Snapshot) -> FloatArray:
    """Of the rows of the bodies."""
    return np.asarray(np.linalg.norm(vectors[: len(now.constitution.mesh.positions)], axis=1))


def history_data(snapshots: Sequence[Snapshot]) -> dict[str, Any]:
    """Energies by kind [J] and momenta [kg m/s, kg m^2/s] of states, one number or triple for each."""
    energies = [now.energies for now in snapshots]
    kinds = (*(field.name for field in dataclasses.fields(Energies)), "total")
    return {
        "energies": {kind: numbers([getattr(each, kind) for each in energies]) for kind in kinds},
        "momentum": [numbers(now.linear_momentum) for now in snapshots],
        "angularMomentum": [numbers(now.angular_momentum()) for now in snapshots],
    }


def field_data(field: NodalField, values: Sequence[FloatArray]) -> dict[str, Any]:
    """A field on the vertices, of frames each (v,), in 8 bits between 0 and a value that few others exceed."""
    rows = np.stack(values)
    largest = float(rows.max(initial=0.0))
    common = float(np.quantile(rows, 1 - _OUTLIERS)) if rows.size else 0.0
    high = common if 0 < 2 * common < largest else largest
    return Quantised.of(rows, 0.0, high, bits=8).data() | {"name": field.name, "largest": largest}
