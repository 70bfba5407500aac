"""Runs in the formats of other tools. Each format is a module here, and a line in `formats`."""

from qlb.export.formats import FORMATS, Exported, export_run, remove_exports
from qlb.export.glb import write_glb
from qlb.export.obj import write_obj
from qlb.export.ply import write_ply
from qlb.export.recording import Recording
from qlb.export.usd import write_usd
from qlb.export.video import write_gif, write_mp4
from qlb.export.vtkhdf import write_vtkhdf
from qlb.export.vtu import write_vtu

__all__ = [
    "FORMATS",
    "Exported",
    "Recording",
    "export_run",
    "remove_exports",
    "write_gif",
    "write_glb",
    "write_mp4",
    "write_obj",
    "write_ply",
    "write_usd",
    "write_vtkhdf",
    "write_vtu",
]
