"""From the thermal tables of path and robot files to models, steps and logs in SI."""

from compgen.thermal.tables.day import ambient_of, believed_rises, held_air, log_of, notes_of_air, shifts_of, steps_of
from compgen.thermal.tables.ensemble import ensemble_of, ensemble_of_words, latest_delay, start_of
from compgen.thermal.tables.materials import check_materials
from compgen.thermal.tables.model import check_sensor_rises, growth_of, network_of, node_model_of, profiles_of
from compgen.thermal.tables.uncertainty import uncertainty_of

__all__ = [
    "ambient_of",
    "believed_rises",
    "check_materials",
    "check_sensor_rises",
    "ensemble_of",
    "ensemble_of_words",
    "growth_of",
    "held_air",
    "latest_delay",
    "log_of",
    "network_of",
    "node_model_of",
    "notes_of_air",
    "profiles_of",
    "shifts_of",
    "start_of",
    "steps_of",
    "uncertainty_of",
]
