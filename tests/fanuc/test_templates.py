"""Long programs are read by columns: the same to the last bit as one by one, in every style, and nothing is lost."""

import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from agreement import assert_readers_agree, differences

from compgen.core.exceptions import InputError
from compgen.fanuc import LsProgram, loads
from compgen.fanuc.listing import position_parser, positions, statement_parser, templates

TESTS = Path(__file__).resolve().parents[1]
ROWS = 1500
ROWS_TIMED = 20_000
TIMES_FASTER = 2.5
BYTES_PER_BYTE = 50
ALLOWED_CAREFULLY = 40  # statements and positions of a regular program that are looked at one by one


def numbers(rows, columns, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (rows, columns)) * 10.0 ** rng.integers(-3, 3, (rows, columns))


def short(text):
    """Without a leading zero, as controllers print."""
    return text.replace("-0.", "-.", 1) if text.startswith("-0.") else text.removeprefix("0")


def cartesian(rows, form="{:9.3f}", gap="  ", tab="\t", name="", more=""):
    for n, row in enumerate(numbers(rows, 8).tolist(), 1):
        said = [form.format(v) for v in row]
        title = f'{n}:"{name} {n}"' if name else f"{n}"
        turn = n % 3 - 1
        yield (
            f"P[{title}]{{\n   GP1:\n{tab}UF : 0, UT : {n % 12},{tab}{tab}CONFIG : 'N U T, {turn}, 0, 0',\n"
            f"{tab}X ={gap}{said[0]}{gap}mm,{tab}Y ={gap}{said[1]}{gap}mm,{tab}Z ={gap}{said[2]}{gap}mm,\n"
            f"{tab}W ={gap}{said[3]} deg,{tab}P ={gap}{said[4]} deg,{tab}R ={gap}{said[5]} deg"
            + more.format(*said[6:])
            + "\n};\n"
        )


def joint(rows, drop_zero=False):
    for n, row in enumerate(numbers(rows, 6, 1).tolist(), 1):
        said = [f"{v:.3f}" for v in row]
        said = [(short(v) if drop_zero else v).rjust(9) for v in said]
        axes = ",\t".join(f"J{i}= {v} deg" for i, v in enumerate(said, 1))
        yield f"P[{n}]{{\n   GP1:\n\tUF : F, UT : 3,\t\n\t{axes}\n}};\n"


def lines(rows, *forms):
    number = 0
    for n in range(1, rows + 1):
        for form in forms:
            if form[1] == 0 or n % form[1] == 0:
                number += 1
                yield form[0].format(i=number, n=n, v=n % 1999 + 1, c=n % 101, d=n / 7) + "\n"


PLAIN = ("   :  L P[{n}] {d:.1f}cm/min FINE ;", 0)
OTHERS = (("{i:4d}:  R[1:force]={d:.2f} ;", 3), ("{i:4d}:  !Layer {n} ;", 5), ("{i:4d}:  DO[1]=ON ;", 2))
LINEAR = ("{i:4d}:L P[{n}] {v}mm/sec CNT{c}    ;", 0)
E1 = ",\n\tE1=  {0}  mm"
GP2 = "\n   GP2:\n\tUF : 0, UT : 1,\t\n\tJ1=  {0} deg,\tJ2=  {1}  mm"
STARS = ",\n\tE1= ******** deg"
STYLES = {
    "our own": (lines(ROWS, LINEAR), cartesian(ROWS), "\r\n"),
    "line feeds": (lines(ROWS, LINEAR), cartesian(ROWS), "\n"),
    "lone carriage returns": (lines(ROWS, LINEAR), cartesian(ROWS), "\r"),
    "six decimals": (lines(ROWS, LINEAR), cartesian(ROWS, "{:12.6f}"), "\r\n"),
    "without padding": (lines(ROWS, PLAIN), cartesian(ROWS, "{:.3f}", " ", "   "), "\n"),
    "two groups": (lines(ROWS, ("{i:4d}:L P[{n}] {v}mm/sec FINE COORD    ;", 0)), cartesian(ROWS, more=GP2), "\r\n"),
    "an extra axis": (lines(ROWS, ("{i}:J P[{n}] {c}% CNT{c} ACC80 ;", 0)), cartesian(ROWS, more=E1), "\r\n"),
    "an untaught axis": (lines(ROWS, LINEAR), cartesian(ROWS, more=STARS), "\r\n"),
    "names": (lines(ROWS, ("{i:4d}:L P[{n}:pt {n}] 30mm/sec FINE    ;", 0)), cartesian(ROWS, name="pt"), "\r\n"),
    "joint form": (lines(ROWS, LINEAR), joint(ROWS), "\r\n"),
    "no leading zeros": (lines(ROWS, LINEAR), joint(ROWS, True), "\n"),
    "arcs": (lines(ROWS, ("{i:4d}:C P[{n}]\n    :  P[{n}] {v}mm/sec FINE    ;", 0)), cartesian(ROWS), "\r\n"),
    "other statements between": (lines(ROWS, LINEAR, *OTHERS), cartesian(ROWS), "\r\n"),
    "disabled motions": (lines(ROWS, LINEAR, ("{i:4d}://J P[{n}] 5% FINE    ;", 2)), cartesian(ROWS), "\r\n"),
}  # fmt: skip
TEXTS = {
    name: ("/PROG  LONG\n/ATTR\n/MN\n" + "".join(mn) + "/POS\n" + "".join(pos) + "/END\n").replace("\n", end).encode()
    for name, (mn, pos, end) in STYLES.items()
}


def both(data):
    """What the columns read and what the careful reader reads."""
    read: list[LsProgram | str] = []
    for few in (100, sys.maxsize):
        try:
            read.append(loads(data, few))
        except InputError as refused:
            read.append(str(refused))
    return read


@pytest.mark.parametrize("style", TEXTS)
def test_columns_read_what_the_careful_reader_reads(style):
    quick, careful = both(TEXTS[style])
    assert len(quick.motions.line) >= ROWS
    assert len(quick.positions.number) >= ROWS
    assert differences(quick, careful) == []


@pytest.mark.parametrize("style", ["our own", "two groups", "names", "no leading zeros", "arcs"])
def test_a_second_reader_agrees_on_long_programs(style):
    assert_readers_agree(TEXTS[style], 100)


@pytest.mark.parametrize("style", TEXTS)
def test_a_regular_program_is_hardly_read_one_by_one(style, monkeypatch):
    count = []
    for module, name in ((positions, "parse_block"), (statement_parser, "take_targets")):
        usual = getattr(module, name)

        def counted(*a, usual=usual):
            count.append(1)
            return usual(*a)

        monkeypatch.setattr(module, name, counted)
    loads(TEXTS[style], 100)
    assert len(count) <= ALLOWED_CAREFULLY


WOUNDS = {
    "a letter in a number": (b"  mm,\tZ", b"O mm,\tZ"),
    "a second point": (b".", b".."),
    "a name with a brace": (b"P[%d]{", b'P[%d:"P[5]{"]{'),
    "blanks": (b" deg,", b"   deg , "),
    "a sign": (b"deg,\tR =  ", b"deg,\tR = +"),
    "a capital": (b"mm/sec", b"MM/SEC"),
    "no end of statement": (b"    ;", b"     "),
    "a remark that wraps": (b":L P[%d]", b":  !it goes\r\n    :  L P[%d]"),
    "stars": (b"X = ", b"X = ******** mm, E1= "),
    "a twin": (b"P[%d]{", b"P[7]{"),
    "no position": (b"};", b"};\r\nnothing"),
    "a long number": (b"Z =", b"Z = 12345678901234567"),
    "an unlike frame": (b"UF : 0", b"UF : F"),
    "a zero byte": (b"CONFIG : 'N", b"CONFIG : '\0"),
}


@pytest.mark.parametrize("wound", WOUNDS)
def test_one_odd_text_among_many_is_read_as_it_is(wound):
    old, new = (text.replace(b"%d", b"777") for text in WOUNDS[wound])
    data = TEXTS["our own"]
    at = data.index(b"P[777]{") if old in data[data.index(b"P[777]{") :] else 0
    at = data.index(b"P[777]") if b":L" in old or b"sec" in old or old == b"    ;" else at
    at = data.index(old, max(at - 3, 0))
    changed = data[:at] + new + data[at + len(old) :]
    quick, careful = both(changed)
    if isinstance(quick, str) or isinstance(careful, str):
        assert quick == careful
    else:
        assert differences(quick, careful) == []
        assert differences(quick, loads(data)) != []


def seconds_to_load(data, few):
    start = time.process_time()
    loads(data, few)
    return time.process_time() - start


def test_columns_are_quicker_and_memory_is_bounded():
    mn, pos = "".join(lines(ROWS_TIMED, LINEAR)), "".join(cartesian(ROWS_TIMED))
    data = ("/PROG  LONG\n/ATTR\n/MN\n" + mn + "/POS\n" + pos + "/END\n").encode()
    quick, careful = (min(seconds_to_load(data, few) for _ in range(3)) for few in (100, sys.maxsize))
    assert careful > TIMES_FASTER * quick
    tracemalloc.start()
    loads(data, 100)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BYTES_PER_BYTE * len(data)


def test_numbers_are_exact_to_the_last_bit():
    texts = ["0.1", "-.1", "123456.789012", "1.", "-0.000", "999999999999.999", "00012.50", "+7", ".000000000000001"]
    data = b"".join(t.rjust(20).encode() + b"|" for t in texts)
    edge = np.arange(0, len(data) + 1, 21)
    filled = templates.match_template(
        templates.padded(data), edge, np.arange(len(texts)), templates.Template((b"", b"|"), (templates.NUMBER,))
    )
    assert filled.which.tolist() == list(range(len(texts)))
    assert filled.value[:, 0].tobytes() == np.array([float(t) for t in texts]).tobytes()


def test_a_shape_needs_to_know_where_its_holes_end():
    assert templates.template_of(b"a1.5", 0, 4, [(templates.DIGITS, 1, 2)]) is None
    assert templates.template_of(b"a1;", 0, 3, [(templates.DIGITS, 1, 2)]) == templates.Template(
        (b"a", b";"), (templates.DIGITS,)
    )
    assert position_parser.AXES is vars(positions)["AXES"]


def test_places_at_a_chunks_end_are_found():
    text = b"ab-ab" * 40
    places = templates.find_places(
        templates.padded(text), 0, len(text), lambda d: (d[:-1] == ord("a")) & (d[1:] == ord("b")), 7
    )
    assert places.tolist() == [n for n in range(len(text)) if text[n : n + 2] == b"ab"]
