"""The real arm, independently: what a program's text makes it do."""

from compgen.verification.twin.faulty_arm import TwinError
from compgen.verification.twin.ride import Leg, Ride, Twin

__all__ = ["Leg", "Ride", "Twin", "TwinError"]
