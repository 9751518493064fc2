r"""What the bodies of a conduction network can be made of, and what no metal can do.

A body of length L, mass m and section A conducts k A and stores m c = rho A L c. So whatever its section,

    conductance L / (m c) = k A L / (m c) <= k / (rho c),        the material's diffusivity [m2/s]

with equality where all of its mass conducts along it; ribs, flanges and cables only store. Limits: Incropera et al.,
Fundamentals of Heat and Mass Transfer, table A.1: pure aluminium 97.1e-6 (cast and wrought alloys 59e-6 to 73e-6), pure
iron 23.1e-6 (carbon steels to 18.8e-6); grey cast iron of brake discs 15.6e-6 to 20.0e-6 (Hecht et al. 1999). Valid at
room temperature.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.thermal.tables import schema as sc


@dataclass(frozen=True, slots=True)
class Material:
    """What a material can store and conduct."""

    heat_capacity: tuple[float, float]  # [J/(kg K)] least and most of its alloys
    diffusivity: float  # [m2/s] most


MATERIALS: Mapping[sc.MaterialName, Material] = {
    "steel": Material((430.0, 510.0), 23.1e-6),
    "cast iron": Material((420.0, 560.0), 23.1e-6),
    "aluminium": Material((850.0, 970.0), 97.1e-6),
}
HOUSING = (380.0, 1000.0)  # [J/(kg K)] copper to aluminium with some grease: a housing is a mixture


def check_materials(table: sc.NetworkTable, where: str) -> None:
    """Refuse bodies and housings that no material could be.

    Args:
        table: The network of a robot file.
        where: The file, for messages.

    Raises:
        InputError: A heat capacity or a conductance that is physically impossible.
    """
    for i, body in enumerate(table.body):
        key, c = f"{where}: thermal.network.body.{i}", body.heat_capacity_J_kgK
        possible = {body.material: MATERIALS[body.material]} if body.material else MATERIALS
        fitting = {n: m for n, m in possible.items() if m.heat_capacity[0] <= c <= m.heat_capacity[1]}
        if not fitting:
            ranges = ", ".join(f"{n} {m.heat_capacity[0]:g} to {m.heat_capacity[1]:g}" for n, m in possible.items())
            raise InputError(
                f"{key}.heat_capacity_J_kgK: {c:g} is not that of its material: {ranges}; give one of these"
            )
        name, material = max(fitting.items(), key=lambda pair: pair[1].diffusivity)
        stored, length = body.mass_kg * c, body.length_mm * MM  # [J/K], [m]
        most = material.diffusivity * stored / length / MM  # [W mm/K]
        if body.conductance_W_mm_K > most:
            diffusivity = body.conductance_W_mm_K * MM * length / stored
            raise InputError(
                f"{key}.conductance_W_mm_K: {body.conductance_W_mm_K:g} over {body.length_mm:g} mm and "
                f"{body.mass_kg:g} kg is a diffusivity of {diffusivity / MM**2:.1f} mm2/s, {name} has at most "
                f"{material.diffusivity / MM**2:.1f}; give {0.999 * most:.4g} or less, or more mass_kg"
            )
    for i, housing in enumerate(table.housing):
        c = housing.heat_capacity_J_kgK
        if not HOUSING[0] <= c <= HOUSING[1]:
            raise InputError(
                f"{where}: thermal.network.housing.{i}.heat_capacity_J_kgK: {c:g} is that of no metal, "
                f"{HOUSING[0]:g} to {HOUSING[1]:g}; give its own, steel has 460"
            )
