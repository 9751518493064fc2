"""Against what positions count a robot's third joint: the pendant's way, and that of DH angles."""

from enum import StrEnum


class J3(StrEnum):
    """Against what the third joint is counted."""

    HORIZONTAL = "horizontal"  # as the pendant has it
    LINK2 = "link2"  # as a DH angle
