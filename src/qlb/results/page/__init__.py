"""What moves on report pages: the result in 3D and plots, as data for the scripts in web/."""

from qlb.results.page.animation import PAGE_BYTES, Animation
from qlb.results.page.charts import run_charts
from qlb.results.page.content import page_content
from qlb.results.page.figures import figures_content
from qlb.results.page.scripts import SCRIPTS_MISSING, page_data, page_scripts

__all__ = [
    "PAGE_BYTES",
    "SCRIPTS_MISSING",
    "Animation",
    "figures_content",
    "page_content",
    "page_data",
    "page_scripts",
    "run_charts",
]
