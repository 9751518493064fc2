"""What a run says: JSON for machines, CSV for each waypoint, HTML for people."""

from compgen.report.csv import waypoints_blocks, waypoints_csv
from compgen.report.html import report_html
from compgen.report.json import report_json, summary

__all__ = [
    "report_html",
    "report_json",
    "summary",
    "waypoints_blocks",
    "waypoints_csv",
]
