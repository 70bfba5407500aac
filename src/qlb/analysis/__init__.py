"""What follows from a state: strain, stress, energies and momentum, from a simulation or from the frames of a run."""

from qlb.analysis.constitution import Constitution
from qlb.analysis.snapshot import Energies, Snapshot

__all__ = ["Constitution", "Energies", "Snapshot"]
