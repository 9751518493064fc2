"""Programs of a controller set to German, against a second dictionary and the same programs in English."""

import re

import numpy as np
import pytest
from corrected import GOLDEN, HOME, REAL, corrected
from ls_text import at, program
from numpy.testing import assert_array_equal
from shipped import ROOT

from compgen.core.exceptions import InputError
from compgen.fanuc.analysis.called_programs import CalledPrograms
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.analysis.unsafe_statements import unsafe_statements
from compgen.fanuc.editing.dry_run_lift import lifted_program
from compgen.fanuc.listing.listing import dumps, loads, other_statements, statement_texts
from compgen.fanuc.paging.split import split_program
from compgen.pipelines.files.robot_file import load_cell
from compgen.program.frames import default_frames
from compgen.robot.robot import Capacity

HEAD = {
    b"OWNER": b"EIGN.", b"COMMENT": b"KOMMENTAR", b"PROG_SIZE": b"PROG_GR\xd6\xdfE", b"CREATE": b"ERSTELL",
    b"MODIFIED": b"GE\xc4NDERT", b"FILE_NAME": b"DATEI_NAME", b"LINE_COUNT": b"ZEILEN", b"PROTECT": b"SCHUTZ",
    b"MEMORY_SIZE": b"SPEICHERGR.", b"TIME_SLICE": b"ZEITSCHEIBE", b"BUSY_LAMP_OFF": b"BUSY_LAMP_AUS",
    b"ABORT_REQUEST": b"ABORT_ANFRAGE", b"PAUSE_REQUEST": b"HALT_ANFRAGE", b"DEFAULT_GROUP": b"DEFAULT_GRUP",
    b"CONTROL_CODE": b"KONTROLLCODE", b"STACK_SIZE": b"STACK_GR\xd6\xdfE",
}  # fmt: skip
#: As a controller prints them, from pairs of public listings of one program in both languages.
WORDS = [
    (rb"\bUFRAME_NUM\b", b"BENUTZER_NUM"), (rb"\bUTOOL_NUM\b", b"WKZ_NUM"), (rb"\bPAYLOAD(?=\s*\[)", b"TRAGLST"),
    (rb"\bCALL\b", b"AUFRUF"), (rb"\bJMP\b", b"SPRUNG"), (rb"\bLBL(?=\[)", b"LABEL"), (rb"\bIF\b", b"WENN"),
    (rb"\bSELECT\b", b"IST   "), (rb"\bELSE\b", b"SONST"), (rb"\bWAIT\b", b"WARTE"), (rb"\bEND\b", b"ENDE"),
    (rb"\bUNLOCK PREG\b", b"FREIG. PREG"), (rb"\bMESSAGE(?=\[)", b"MELDUNG"), (rb"\bUALM(?=\[)", b"BALM"),
    (rb"\bSKIP CONDITION\b", b"IRQ BEDINGUNG"), (rb"\bOFFSET CONDITION\b", b"OFFSET BEDINGUNG"),
    (rb"\bSkip(?=,)", b"Interrupt"), (rb"\bTB(?=[ .\d])", b"ZEIT VOR"), (rb"\bDB(?=[ .\d])", b"WEG VOR"),
    (rb"(?<![\w$])R(?=\[)", b"i"), (rb"\bGO(?=\[)", b"gA"), (rb"\bGI(?=\[)", b"gE"), (rb"\bDO(?=\[)", b"A"),
    (rb"\bDI(?=\[)", b"E"), (rb"\bON\b", b"AN"), (rb"\bOFF\b", b"AUS"), (rb" AND ", b" [&] "), (rb" OR ", b" [+] "),
    (rb"(?<![A-Za-z])(m?)sec\b", rb"\1sek"), (rb"\bFINE\b", b"FEIN"), (rb"\bTHEN\b", b"DANN"),
    (rb"\bPAUSE\b", b"HALT"),
]  # fmt: skip
_KEPT = re.compile(rb"\[\s*\d+\s*:[^\]\r\n]*|'[^'\r\n]*'|(?<=MESSAGE)\[[^\]]*|(?<=CALL )[^\s(;]+")


def in_german(data):
    """An English listing as a controller set to German prints it."""
    out, section = [], b""
    for line in data.splitlines(keepends=True):
        if tag := re.match(rb"/([A-Z]+)", line):
            section = tag[1]
        if section == b"ATTR":
            line = re.sub(rb"^( *(?:TCD: *)?)([A-Z_]+)(?=[ \t]*=)", lambda m: m[1] + HEAD.get(m[2], m[2]), line)
        elif section == b"MN" and not re.match(rb"\s*\d*\s*:\s*(?://)?\s*(?:!|--)", line):
            line = statement(line)
        elif section == b"POS":
            line = re.sub(rb"\bCONFIG(?=[ \t]*:)", b"KONFIG", line)
        out.append(line)
    return b"".join(out)


def statement(line):
    """Its words, but names, texts and programs as they are."""
    kept = _KEPT.findall(line)
    parts = _KEPT.split(line)
    for pattern, word in WORDS:
        parts = [re.sub(pattern, word, part) for part in parts]
    return b"".join(part + text for part, text in zip(parts, [*kept, b""], strict=True))


def common(text):
    """A statement without what is passed through, and without blanks."""
    for german, english in ((r"A(?=\[)", "DO"), (r"E(?=\[)", "DI"), ("AN", "ON"), ("AUS", "OFF")):
        text = re.sub(rf"(?<![\w$]){german}(?!\w)", english, text)
    text = text.replace("[&]", "AND").replace("[+]", "OR")
    return re.sub(r"\s+", "", text)


def sample(count=9, seed=4):
    """Motions, and the statements that stand between them in public German programs."""
    rng = np.random.default_rng(seed)
    q = np.array(HOME) + rng.uniform(-12, 12, (count, 6))
    moves = [f"J P[{n}] {rng.integers(5, 60)}% {('FINE', 'CNT40')[n % 2]} ACC80" for n in range(1, count)]
    moves[3:3] = ["L P[4:END OF 2] 250mm/sec FINE TB    .10sec,CALL GRIP", "UFRAME_NUM=0 ", "UTOOL_NUM=0 "]
    moves[2:2] = ["PAYLOAD[2] ", "WAIT   0.50(sec) ", "WAIT (DI[3] AND !DI[4]) ", "IF (DI[7]),JMP LBL[2] "]
    moves += [
        "LBL[2] ",
        "!CALL of WARTE, END ",
        "R[5:COUNT]=R[5:COUNT]+1 ",
        f"L P[{count}] 100mm/sec FINE DB 5.0mm,DO[3]=ON",
    ]
    moves += ["MESSAGE[END OF CALL] ", "CALL PARK(R[3],'ON') ", "END "]
    head = (
        'OWNER\t\t= MNEDITOR;\nCOMMENT\t\t= "END OF CALL";\nCREATE\t\t= DATE 24-03-17  TIME 09:31:46;\n'
        "LINE_COUNT\t= 20;\nPROTECT\t\t= READ_WRITE;\nTCD:  STACK_SIZE\t= 0,\n      PAUSE_REQUEST\t= 0;\n"
        "DEFAULT_GROUP\t= 1,*,*,*,*;\n"
    )
    return program(moves, [at(n, row) for n, row in enumerate(q, 1)], name="TEIL", head=head)


ENGLISH = {"sample": sample(), **{p.name: p.read_bytes() for p in [*GOLDEN, *REAL]}}


@pytest.mark.parametrize("name", ENGLISH)
def test_a_german_program_is_read_as_the_english_one(name):
    english, german = loads(ENGLISH[name]), loads(in_german(ENGLISH[name]))
    if german.source == english.source:
        pytest.skip("it has no word of a language")
    assert dumps(german) == in_german(ENGLISH[name])
    assert len(german.data) == len(german.source)
    for column in ("letter", "speed", "termination", "line", "position"):
        assert list(getattr(german.motions, column)) == list(getattr(english.motions, column)), column
    options = [[common(text) for text in program.motions.options] for program in (german, english)]
    assert options[0] == options[1]
    texts = [[common(text) for text in statement_texts(program)] for program in (german, english)]
    assert texts[0] == texts[1]
    assert [line for line, _ in other_statements(german)] == [line for line, _ in other_statements(english)]
    assert german.remarks == english.remarks
    assert_array_equal(german.positions.value, english.positions.value)
    assert german.positions.config == english.positions.config
    assert dict(german.attributes).get("COMMENT") == dict(english.attributes).get("COMMENT")
    assert dict(german.attributes).get("DEFAULT_GROUP") == dict(english.attributes).get("DEFAULT_GROUP")
    flows = [read_flow(program) for program in (german, english)]
    assert_array_equal(flows[0].motion, flows[1].motion)


@pytest.fixture(scope="module")
def cell():
    return load_cell(str(ROOT / "robots" / "m710ic50.toml"))


def test_pages_and_a_dry_run_are_in_its_own_words():
    few = Capacity(max_lines=12, max_positions=100, memory=1e6, name_length=8)
    jump = b"IF (DI[7]),JMP LBL[2] "  # a page would hold it and its label
    plain = sample().replace(jump, b"WAIT (DI[7]) ")
    english, german = (split_program(loads(text), few) for text in (plain, in_german(plain)))
    assert len(german.pages) > 1
    for page, same in zip(german.pages, english.pages, strict=True):
        assert page.data == in_german(same.data)
    assert german.main == in_german(english.main)
    still, frames = CalledPrograms(motionless=frozenset({"GRIP", "PARK"})), default_frames().uframe
    lifted = [lifted_program(loads(text), 10.0, 8, still, frames) for text in (sample(), in_german(sample()))]
    assert dumps(lifted[1]) == in_german(dumps(lifted[0]))


@pytest.mark.parametrize(
    ("words", "meaning"),
    [
        (b"LABEL[1] ;", "LBL[1]"),
        (b"WENN (E[1]),WKZ_NUM=2 ;", "IF (E[1]),UTOOL_NUM=2"),
        (b"IST    i[2]=1,SPRUNG LABEL[3] ;", "SELECT    R[2]=1,JMP LBL[3]"),
        (b"PR[GP1:11,1]=(gE[25]*(.1)) ;", "PR[GP1:11,1]=(GI[25]*(.1))"),
        (b"AUFRUF VW_USER(Basic1,EIN/AUS=1) ;", "CALL VW_USER(Basic1,EIN/AUS=1)"),
        (b"AUFRUF HALT ;", "CALL HALT"),
        (b"MELDUNG[WARTE auf ENDE] ;", "MESSAGE[WARTE auf ENDE]"),
        (b"//WARTE i[i[2]]=3 ;", "//WAIT R[R[2]]=3"),
        (b"i[5:ENDE]=i[6:FEIN] ;", "R[5:ENDE]=R[6:FEIN]"),
        (b"$SSR.$SINGLESTEP=i[819] ;", "$SSR.$SINGLESTEP=R[819]"),
        (b"FB-PSPS (AN) ;", "FB-PSPS (AN)"),
    ],
)
def test_a_german_statement_is_read_in_english_words(words, meaning):
    text = b'/PROG  X\n/ATTR\nKOMMENTAR = "";\n/MN\n   1:  ' + words + b"\n/POS\n/END\n"
    read = loads(text)
    assert statement_texts(read) == [meaning]
    assert dumps(read) == text


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (b"Pendeln Sinus[1] ;", "a German word that is not known"),
        (b"F\xdcR i[1]=1 BIS 5 ;", "a German word that is not known"),
        (b"BENUTZER[1]=PR[2] ;", "UFRAME[] is written"),
        (b"WKZ[2]=PR[3] ;", "UTOOL[] is written"),
        (b"P[1]=LPOS ;", "a position is written at run time"),
        (b"WZGKOORD[1]=PR[3] ;", "a German word that is not known"),
        (b"WERKZEUG_NUM=2 ;", "a German word that is not known"),
        (b"WENN A[1]=AN,WERKZEUG_NUM=2 ;", "a German word that is not known"),
        (b"WENN A[1]=AN,i[2]=i[2]+1 ;", ""),
        (b"OVERRIDE=100% ;", ""),
        (b"FB-PSPS (E[3] [&] M[2]) ;", ""),
        (b"A[80]=AN ;", ""),
        (b"TIMER[3]=STOPP ;", ""),
        (b"WENN (A[12]=AN),AUFRUF MAKRO998 ;", ""),
        (b"WENN A[1]=AUS,SPRUNG LABEL[1] ;", ""),
        (b"$SSR.$SINGLESTEP=0 ;", ""),
        (b"FREIG. PREG ;", ""),
    ],
)
def test_what_makes_a_german_program_unsafe_is_told(words, reason):
    read = loads(b'/PROG  X\n/ATTR\nKOMMENTAR = "";\n/MN\n   1:  ' + words + b"\n/POS\n/END\n")
    reasons = [unsafe.reason for unsafe in unsafe_statements(read)]
    assert len(reasons) == bool(reason)
    assert all(reason in told for told in reasons)


def test_an_english_program_with_german_remarks_stays_english():
    remarks = [
        b"!Nach P[1] 2sek warten, KONFIG : 'N U T' ;",
        b"!WENN AUFRUF:",
        b"  :  WARTE BIS ENDE ;",
        b"CALL AUFRUF ;",
    ]
    body = b"".join((b"" if r.startswith(b"  :") else b"%4d:  " % n) + r + b"\n" for n, r in enumerate(remarks, 1))
    read = loads(b'/PROG  WARTE\n/ATTR\nCOMMENT = "KOMMENTAR";\n/MN\n' + body + b"/POS\n/END\n")
    assert not read.is_german
    assert read.data is read.source


@pytest.mark.parametrize("sign", [b"EIGN.", b"KONFIG", b"sek", b"AUFRUF"])
def test_each_sign_alone_makes_a_program_german(sign):
    whole = in_german(program(["J P[1] 10% CNT0", "L P[1] 5mm/sec CNT0", "CALL A"], [at(1, HOME)], head="OWNER = X;\n"))
    plain = {b"EIGN.": b"OWNER", b"KONFIG": b"CONFIG", b"sek": b"sec", b"AUFRUF": b"CALL"}
    for other in plain.keys() - {sign}:
        whole = whole.replace(other, plain[other])
    assert loads(whole).is_german
    assert not loads(whole.replace(sign, plain[sign])).is_german


def test_words_that_have_no_room_are_refused():
    with pytest.raises(InputError, match="line 3: its German words cannot be read"):
        loads(b"/PROG  X\n/MN\n1:WKZ_NUM=2;\n/POS\n/END\n")


def test_a_german_program_is_corrected_to_the_same_numbers_in_its_own_words(cell):
    english, german = corrected(sample(), cell), corrected(in_german(sample()), cell)
    assert german.text != german.planned
    assert german.text == in_german(english.text)


def test_points_put_into_a_german_program_have_its_words(cell):
    rows = np.array(HOME) + np.array([[0, 0, 0, 0, 0, 0], [25, 5, 0, 0, 0, 0], [-20, 0, 5, 0, 0, 0]])
    moves = ["J P[1] 10% FINE", "L P[2] 250mm/sec FINE ACC80", "L P[3] 8.0sec FINE", "L P[1] 90mm/sec CNT20"]
    text = program(moves, [at(n, row) for n, row in enumerate(rows, 1)], head='COMMENT\t\t= "";\n')
    english, german = (corrected(given, cell, insert=0.05e-6) for given in (text, in_german(text)))
    assert len(loads(german.text).positions.number) > len(rows)
    assert german.text == in_german(english.text)
