"""What a run says: JSON for machines, CSV for each waypoint, HTML for people."""

from compgen.report.job_page import report_html
from compgen.report.summary import report_data, report_json
from compgen.report.waypoints_csv import waypoints_blocks

__all__ = [
    "report_data",
    "report_html",
    "report_json",
    "waypoints_blocks",
]
