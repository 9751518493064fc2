"""The real arm, independently: what a program's text makes it do."""

from compgen.twin.drive import Leg, Ride, Twin
from compgen.twin.real_arm import TwinError

__all__ = ["Leg", "Ride", "Twin", "TwinError"]
