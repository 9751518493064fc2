"""Tables are checked once, at the edge; whatever a file holds, a refusal is one short line that names the key."""

import math
import tomllib
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError, TableError
from compgen.core.toml import Table, check, dotted_keys, override, read_toml, suggest, table_of_words, toml_value
from compgen.identification.tables import ArtefactFile
from compgen.program.frames import load_frames


class Inner(Table):
    """A table in a table."""

    from_: Annotated[str, Field(alias="from")]
    size: Annotated[FiniteFloat, Field(gt=0, le=10)] = 1.0


class Round(Table):
    """One choice of a tagged union."""

    shape: Literal["round"]
    diameter: FiniteFloat


class Square(Table):
    """The other choice."""

    shape: Literal["square"]
    side: FiniteFloat


class Outer(Table):
    """Every kind of value."""

    name: Annotated[str, Field(pattern="^[a-z]+$", max_length=4, examples=["name = 'abc'"])]
    kind: Literal["a", "b"] = "a"
    either: Literal["x"] | Annotated[FiniteFloat, Field(ge=0)] | None = None
    table: FiniteFloat | dict[str, FiniteFloat] = 0.0
    rows: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2)] = [1, 2]  # noqa: RUF012
    more: dict[str, Any] = {}  # noqa: RUF012
    on: bool = False
    inner: Inner | None = None
    many: list[Inner] = []  # noqa: RUF012
    part: Annotated[Round | Square, Field(discriminator="shape")] | None = None


GOOD = {"name": "abc", "either": 3, "rows": [4, 5], "more": {"k": [1]}, "on": True, "inner": {"from": "z", "size": 2}}


def nested(depth):
    table: dict[str, Any] = {"a": 1}
    for _ in range(depth):
        table = {"a": table}
    return table


def refusal(changes):
    with pytest.raises(InputError) as caught:
        check(Outer, {**GOOD, **changes}, "file.toml")
    message = str(caught.value)
    assert message.startswith("file.toml: ")
    assert len(message) <= 300
    assert message.isprintable()
    return message.removeprefix("file.toml: ")


def test_what_is_right_becomes_values():
    table = check(Outer, GOOD, "file.toml")
    assert (table.name, table.either, table.rows, table.more, table.on) == ("abc", 3.0, [4, 5], {"k": [1]}, True)
    assert table.inner is not None
    assert (table.inner.from_, table.inner.size, table.many, table.part) == ("z", 2.0, [], None)
    assert isinstance(table.inner.size, float)
    assert table.model_fields_set == set(GOOD)
    with pytest.raises(ValueError, match="frozen"):
        table.name = "d"


def test_defaults_are_not_shared():
    one, other = (check(Outer, {"name": "a"}, "file.toml") for _ in range(2))
    one.rows.append(7)
    assert other.rows == [1, 2]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"nme": "x"}, "nme: unknown key; did you mean 'name'?"),
        ({"inner": {"from": "z", "zzz": 1}}, "inner.zzz: unknown key; known: from, size"),
        ({"inner": {"from_": "z"}}, "inner.from_: unknown key; did you mean 'from'?"),
        ({"many": [{"from": "z"}, {"from": "z", "sizes": 1}]}, "many.1.sizes: unknown key; did you mean 'size'?"),
        ({"part": {"shape": "square", "sid": 1}}, "part.sid: unknown key; did you mean 'side'?"),
        ({"part": {"shape": "round", "xyz": 1}}, "part.xyz: unknown key; known: shape, diameter"),
    ],
)
def test_an_unknown_key_is_named_with_what_was_meant(changes, message):
    assert refusal(changes) == message


def test_a_key_of_eighty_characters_is_named_whole_and_a_longer_one_is_cut_to_them():
    assert refusal({80 * "k": 1}).startswith(f"{80 * 'k'}: unknown key")
    assert refusal({81 * "k": 1}).startswith(f"{77 * 'k'}...: unknown key")


def test_known_keys_are_listed_where_they_are_a_dozen_at_most():
    known = [f"key{n}" for n in range(13)]
    assert suggest("zzz", known[:12]) == f"; known: {', '.join(known[:12])}"
    assert suggest("zzz", known) == ""


def test_an_unknown_key_comes_before_a_missing_one():
    assert refusal({"inner": {"fron": "z"}}) == "inner.fron: unknown key; did you mean 'from'?"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inner": {}}, "inner.from: missing; add it"),
        ({"many": [{"from": "z"}, {}]}, "many.1.from: missing; add it"),
        ({"part": {"shape": "round"}}, "part.diameter: missing; add it"),
        ({"part": {"diameter": 1}}, "part.shape: missing; known: round, square"),
        ({"inner": {}, "many": [{"from": "z"}, {}]}, "inner.from, many.1.from: missing; add them"),
        (
            {"many": [{}] * 9, "part": {"shape": "round"}},
            ", ".join(f"many.{i}.from" for i in range(8)) + " and 2 more: missing; add them",
        ),
    ],
)
def test_a_missing_key_is_named(changes, message):
    assert refusal(changes) == message


def test_a_missing_key_is_shown_where_its_table_has_an_example():
    with pytest.raises(InputError) as caught:
        check(Outer, {"many": [{}]}, "file.toml")
    assert str(caught.value) == "file.toml: name, many.0.from: missing; add them: name = 'abc'"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": 3}, "name: 3: must be a valid string"),
        ({"on": 1}, "on: 1: must be a valid boolean"),
        ({"rows": 3}, "rows: 3: must be a valid list"),
        ({"rows": {"a": 1}}, "rows: a table: must be a valid list"),
        ({"many": {"from": "z"}}, "many: one table, and a list is wanted; say [[many]]"),
        ({"rows": [1, 1.5]}, "rows.1: 1.5: must be a valid integer"),
        ({"inner": {"from": "z", "size": True}}, "inner.size: True: must be a valid number"),
        ({"inner": {"from": "z", "size": "2"}}, "inner.size: '2': must be a valid number"),
        ({"inner": 3}, "inner: 3 must be a table"),
        ({"more": 3}, "more: 3 must be a table"),
        ({"part": [1]}, "part: [1] must be a table"),
        ({"part": {"shape": 3}}, "part.shape: 3 is unknown; known: round, square"),
        ({"part": {"shape": "rond"}}, "part.shape: 'rond' is unknown; known: round, square; did you mean 'round'?"),
        ({"kind": "c"}, "kind: 'c': must be 'a' or 'b'"),
    ],
)
def test_a_wrong_type_is_named_with_its_value(changes, message):
    assert refusal(changes) == message


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "ABC"}, "name: 'ABC': must match pattern '^[a-z]+$'"),
        ({"name": "abcde"}, "name: 'abcde': must have at most 4 characters"),
        ({"rows": [1]}, "rows: [1]: must have at least 2 items, not 1"),
        ({"rows": [1, 0]}, "rows.1: 0: must be greater than or equal to 1"),
        ({"many": [{"from": "z", "size": 0}]}, "many.0.size: 0: must be greater than 0"),
        ({"inner": {"from": "z", "size": 11}}, "inner.size: 11: must be less than or equal to 10"),
        ({"inner": {"from": "z", "size": math.nan}}, "inner.size: nan is not a number; give a finite one"),
        ({"inner": {"from": "z", "size": -math.inf}}, "inner.size: -inf is not a number; give a finite one"),
    ],
)
def test_a_value_out_of_bounds_is_named_with_its_limit(changes, message):
    assert refusal(changes) == message


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"either": "y"}, "either: 'y': must be 'x', or must be a valid number"),
        ({"either": -1}, "either: -1: must be 'x', or must be greater than or equal to 0"),
        ({"either": math.nan}, "either: nan: must be 'x', or must be a finite number"),
        ({"table": "y"}, "table: 'y': must be a valid number, or must be a table"),
        ({"table": {"k": "y"}}, "table.k: 'y': must be a valid number"),
    ],
)
def test_every_choice_of_a_union_is_told_and_no_name_of_ours(changes, message):
    assert refusal(changes) == message


@pytest.mark.parametrize(
    "changes",
    [
        {"name": nested(3000)},
        {"inner": nested(3000)},
        {"part": nested(3000)},
        {"part": {"shape": nested(3000)}},
        {"rows": nested(3000)},
        {"rows": [[[[[[[["x" * 1000] * 1000]]]]]]]},
        {"inner": {"from": "z", "size": 10**400}},
        {"rows": [1, -(16**5000)]},
        {"name": "x" * 100_000},
        {"x" * 100_000: 1},
        {"a\nb\x1b[31m": 1},
        {"name": "a\nb\x1b[31m" * 100},
        {"many": [{"x" * 1000: 1}] * 1000},
    ],
    ids=range(13),
)
def test_a_hostile_file_gives_one_short_line(changes):
    refusal(changes)


def test_what_is_nested_as_deep_as_a_table_needs_is_taken():
    assert check(Outer, {**GOOD, "more": nested(19)}, "file.toml").more == nested(19)
    assert refusal({"more": nested(20)}) == "more: nested more than 20 deep; remove it, no key here needs that"


def test_deep_keys_of_a_file_are_one_line(tmp_path):
    file = tmp_path / "deep.toml"
    deep = ".".join(990 * "a")  # more than 1000 parts of a key Python refuses from 3.14 on
    file.write_text(f"name = 'abc'\nmore.{deep} = 1\nkind.{deep} = 1\n")
    with pytest.raises(InputError, match=r"^deep: more: nested more than 20 deep; remove it, no key here needs that$"):
        check(Outer, read_toml(file, "paths"), "deep")
    file.write_text(f"name = {'[' * 100_000}")
    with pytest.raises(InputError, match="not TOML") as caught:
        read_toml(file, "paths")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("assignment", "expected"),
    [
        ("a.b=2", {"a": {"b": 2}, "rows": [{"k": 1}]}),
        ("a.c = text", {"a": {"b": 1, "c": "text"}, "rows": [{"k": 1}]}),
        ("rows.0.k=[1, 2]", {"a": {"b": 1}, "rows": [{"k": [1, 2]}]}),
        ("rows.1.k=2", {"a": {"b": 1}, "rows": [{"k": 1}, {"k": 2}]}),
        ("new.table.key=1.5", {"a": {"b": 1}, "rows": [{"k": 1}], "new": {"table": {"key": 1.5}}}),
        ("more.0.k=2", {"a": {"b": 1}, "rows": [{"k": 1}], "more": [{"k": 2}]}),
    ],
)
def test_an_override_sets_one_key(assignment, expected):
    data: dict[str, Any] = {"a": {"b": 1}, "rows": [{"k": 1}]}
    override(data, assignment, assignment)
    assert data == expected


@pytest.mark.parametrize(
    "assignment", ["a", "=1", "a.b.c=1", "rows.2.k=1", "rows.x=1", "rows.-1=1", f"a.b{1000 * '.c'}=1"]
)
def test_an_override_that_leads_nowhere_is_refused(assignment):
    with pytest.raises(InputError, match=r"^--set robot\.") as caught:
        override({"a": {"b": 1}, "rows": [{"k": 1}]}, assignment, f"robot.{assignment}")
    assert len(str(caught.value)) <= 300


@pytest.mark.parametrize(
    "value",
    [
        True,
        False,
        0,
        -7,
        1e-9,
        12.5,
        "",
        'a "b" \\ c',
        "\x00\t\n\x7f\x80",
        "Größe 🤖",
        [1, [2.5, "x"]],
        {"a b": {"ä": [False]}},
    ],
)
def test_a_value_as_toml_is_read_as_itself(value):
    assert tomllib.loads(f"x = {toml_value(value)}") == {"x": value}


@pytest.mark.parametrize("words", ["a=1, b='x'", "{a=1, b='x'}", "  { a = 1 , b = 'x' } "])
def test_words_are_the_keys_of_a_table_with_braces_or_without(words):
    assert table_of_words(words, "--some", "a=1") == {"a": 1, "b": "x"}


@pytest.mark.parametrize("words", ["a", "a=1}, y={b=2", "a=1\ny=2", "a=1,,"])
def test_words_that_are_no_table_are_shown_how_to_be_written(words):
    with pytest.raises(InputError, match=r"^--some: .* is not understood; write it as in 'a=1, b=2'$"):
        table_of_words(words, "--some", "a=1, b=2")


def test_dotted_keys_set_one_after_the_other_are_the_tables_again():
    tables = {"a": {"b": 1, "c": {"d": [1, 2]}}, "rows": [{"e": "x", "f": []}, {"e": "y"}], "g": True}
    keys = dotted_keys(tables)
    assert keys == {"a.b": 1, "a.c.d": [1, 2], "rows.0.e": "x", "rows.0.f": [], "rows.1.e": "y", "g": True}
    again: dict[str, Any] = {}
    for key, value in keys.items():
        override(again, f"{key}={toml_value(value)}", key)
    assert again == tables


def test_a_file_as_windows_editors_save_it_is_read(tmp_path):
    file = tmp_path / "f.toml"
    keys = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
    text = "\ufeff[utool.1]\r\n" + "".join(f"{key} = 1\r\n" for key in keys)
    file.write_bytes(text.encode())
    assert read_toml(file, "paths")["utool"]["1"]["x_mm"] == 1
    assert load_frames(str(file)).utool[1].position.tolist() == [1e-3] * 3


def test_points_given_in_place_of_a_path_file_are_led_to_one(tmp_path):
    points = tmp_path / "my.csv"
    points.write_text("x_mm,y_mm,z_mm\n1,2,3\n")
    with pytest.raises(InputError, match=r"my.csv: not TOML: .*; give a TOML file; .* by \[path\] pattern and file"):
        read_toml(points, "paths")


def test_a_number_of_thousands_of_digits_is_refused_without_pythons_advice(tmp_path):
    file = tmp_path / "f.toml"
    file.write_text(f"name = {'9' * 5000}")
    for read in (lambda: read_toml(file, "paths"), lambda: load_frames(str(file))):
        with pytest.raises(InputError, match="5000 digits") as caught:
            read()
        assert "sys." not in str(caught.value)


@pytest.mark.parametrize(
    "character", ["\x1b", "\x07", "\r", "\x00", "\x7f", "\x9b", "\u202e", "\u2066", "\u200f", "\u2028"]
)
def test_what_would_steer_a_terminal_or_a_page_is_refused_by_its_key(character):
    class Row(Table):
        text: str

    class Titled(Table):
        title: str = ""
        rows: tuple[Row, ...] = ()

    for data, key in (
        ({"title": f"a{character}[31mb"}, "title"),
        ({"rows": [{"text": "b"}, {"text": character}]}, "rows.1.text"),
        ({"rows": [{f"n{character}": "x"}]}, "rows.0."),
    ):
        with pytest.raises(
            TableError, match="it holds a control character or a mark of direction; remove it"
        ) as caught:
            check(Titled, data, "f.toml")
        assert str(caught.value).startswith(f"f.toml: {key}")
        assert str(caught.value).isprintable()
    assert check(Titled, {"title": "Größe\t日本 שלום\n"}, "f.toml").title == "Größe\t日本 שלום\n"


def test_a_name_with_a_blank_is_refused_in_words():
    with pytest.raises(TableError, match=r"sphere\.0\.name: 'ball 1': must be of letters, digits, _ \. \+ and -, with"):
        check(ArtefactFile, {"sphere": [{"name": "ball 1"}]}, "f.toml")
