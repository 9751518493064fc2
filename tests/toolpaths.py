"""Tool paths for tests: a pattern on a surface, laid as the package lays it."""

from compgen.planning import toolpath
from compgen.planning.exact_path import MAX_SPACING, ExactPath


def laid(curve, surface, boundary, *, chord, spin=0.0, lift=0.0, spacing=MAX_SPACING):
    """Waypoints of a pattern on a surface."""
    bare = ExactPath(curve=curve, surface=surface, boundary=boundary, spin=spin)
    return toolpath.plan_tool_path(bare, toolpath.LayoutSettings(chord, spacing), lift=lift)
