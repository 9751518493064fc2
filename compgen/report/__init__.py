"""Reports: JSON for machines, CSV for each waypoint, HTML for people."""

from compgen.report.job_page import job_html
from compgen.report.job_summary import job_summary
from compgen.report.waypoints_csv import waypoints_blocks

__all__ = [
    "job_html",
    "job_summary",
    "waypoints_blocks",
]
