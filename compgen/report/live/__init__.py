"""The part of a what-if page that lives: sliders, and a script that computes what they do."""

from compgen.report.live.section import NONE, LiveSection, live_section, without_sliders

__all__ = ["NONE", "LiveSection", "live_section", "without_sliders"]
