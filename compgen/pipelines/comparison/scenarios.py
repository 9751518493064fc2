"""The scenarios of two studies, matched by the values that were varied."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import UM
from compgen.pipelines.comparison.agreement import ERROR
from compgen.pipelines.comparison.outputs import Output, naming_damage, number

_COLUMN = {"before": "before_on_part_max_um", "after": "after_on_part_max_um"}


@dataclass(frozen=True, eq=False, slots=True)
class MatchedScenarios:
    """Scenarios that both studies have, and how their largest errors changed."""

    both: int  # with the same values, done in both
    only_a: int
    only_b: int
    changes: Mapping[str, Array]  # side to b - a [m], of scenarios that have it in both
    worst: Mapping[str, Mapping[str, Any]]  # side to the values of the scenario that changed most

    @property
    def is_equal(self) -> bool:
        """Whether both studies have the same scenarios with the same errors."""
        return not (
            self.only_a or self.only_b or any(np.any(np.abs(change) >= ERROR) for change in self.changes.values())
        )


def match_scenarios(a: Output, b: Output) -> MatchedScenarios:
    """The scenarios of two studies by the values of all keys that either varied."""
    tables = []
    for output in (a, b):
        with naming_damage(output):
            keys = [str(key) for key in output.record["keys"]]
            rows = [row for row in output.record["scenarios"] if row["state"] == "done"]
            tables.append({tuple(sorted((key, str(row[key])) for key in keys)): row for row in rows})
    same = [values for values in tables[0] if values in tables[1]]
    changes, worst = {}, {}
    for side, column in _COLUMN.items():
        with naming_damage(b):
            pairs = [(values, tables[0][values], tables[1][values]) for values in same]
            rows = [
                (v, (number(y[column]) - number(x[column])) * UM) for v, x, y in pairs if column in x and column in y
            ]
        if rows:
            changes[side] = np.array([change for _, change in rows])
            worst[side] = dict(rows[int(np.abs(changes[side]).argmax())][0])
    return MatchedScenarios(len(same), len(tables[0]) - len(same), len(tables[1]) - len(same), changes, worst)
