"""Tables checked by pydantic's engine from our annotations: as pydantic itself would check them."""

from typing import Annotated, Any, Literal

import pydantic
import pytest
from pydantic_core import ValidationError

from compgen import schema as sc
from compgen.tables import FiniteFloat, Table, keys_of, told, validator, within


class Inner(Table):
    """A table in a table."""

    from_: str
    size: Annotated[FiniteFloat, within(gt=0, le=10)] = 1.0


class Outer(Table):
    """Every kind of value."""

    name: Annotated[str, within(pattern="^[a-z]+$", max_length=4)]
    kind: Literal["a", "b"] = "a"
    either: Literal["x"] | Annotated[FiniteFloat, within(ge=0)] | None = None
    rows: Annotated[list[Annotated[int, within(ge=1)]], within(min_length=2)] = [1, 2]  # noqa: RUF012
    more: dict[str, Any] = {}  # noqa: RUF012
    on: bool = False
    inner: Inner | None = None
    many: list[Inner] = []  # noqa: RUF012


class InnerModel(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True, frozen=True, title="Inner")
    from_: str = pydantic.Field(alias="from")
    size: Annotated[pydantic.FiniteFloat, pydantic.Field(gt=0, le=10)] = 1.0


class OuterModel(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True, frozen=True, title="Outer")
    name: Annotated[str, pydantic.Field(pattern="^[a-z]+$", max_length=4)]
    kind: Literal["a", "b"] = "a"
    either: Literal["x"] | Annotated[pydantic.FiniteFloat, pydantic.Field(ge=0)] | None = None
    rows: Annotated[list[Annotated[int, pydantic.Field(ge=1)]], pydantic.Field(min_length=2)] = [1, 2]
    more: dict[str, Any] = {}
    on: bool = False
    inner: InnerModel | None = None
    many: list[InnerModel] = []


GOOD = {"name": "abc", "either": 3, "rows": [4, 5], "more": {"k": [1]}, "on": True, "inner": {"from": "z", "size": 2}}


def complaints(call):
    with pytest.raises(ValidationError) as caught:
        call()
    return [(e["type"], e["loc"], e["msg"]) for e in caught.value.errors()]


@pytest.mark.parametrize(
    "change",
    [
        {"name": "ABC"}, {"name": "abcde"}, {"name": 3}, {"nme": "x"}, {"kind": "c"}, {"either": -1}, {"either": "y"},
        {"either": float("nan")}, {"rows": [1]}, {"rows": [0, 1]}, {"rows": [1.5, 2]}, {"rows": 3}, {"more": 3},
        {"on": 1}, {"inner": 3}, {"inner": {}}, {"inner": {"from_": "z"}}, {"inner": {"from": "z", "size": True}},
        {"inner": {"from": "z", "size": 0}}, {"many": [{"from": "z"}, {"from": 1}]}, {"more": {3: 1}},
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_as_by_pydantic(change):
    data = {**GOOD, **change}
    mine = complaints(lambda: validator(Outer).validate_python(data))
    theirs = complaints(lambda: OuterModel.model_validate(data))
    assert [c[0::2] for c in mine] == [(t, m.replace("InnerModel", "Inner")) for t, _, m in theirs]
    assert [c[1] for c in mine] == [c[1] for c in theirs]


def test_what_is_right_becomes_the_same_values():
    mine, theirs = validator(Outer).validate_python(GOOD), OuterModel.model_validate(GOOD)
    for name in ("name", "kind", "either", "rows", "more", "on", "many"):
        assert getattr(mine, name) == getattr(theirs, name)
    assert (mine.inner.from_, mine.inner.size) == ("z", 2.0)
    assert isinstance(mine.inner.size, float)
    assert told(mine) == theirs.model_fields_set


def test_defaults_are_not_shared():
    one, other = (validator(Outer).validate_python({"name": "a"}) for _ in range(2))
    one.rows.append(7)
    assert other.rows == [1, 2]


def test_a_table_stays_as_it_is_and_makes_others():
    table = Inner(**{"from": "z"})
    with pytest.raises(AttributeError):
        table.size = 3.0
    other = table.replaced(size=3.0)
    assert (table.size, other.size, other.from_, told(other)) == (1.0, 3.0, "z", {"from_"})


def test_keys_come_with_those_of_the_table_above():
    assert list(keys_of(sc.LineTable)) == ["x_mm", "y_mm", "z_mm", "pattern", "axis", "length_mm"]
    assert keys_of(Inner)["from"][0] == "from_"
