"""Programs nobody wrote, for hypothesis: every print of numbers, names, targets, options and line ends."""

from functools import cache

from hypothesis import strategies as st

NAMES = st.sampled_from(["", "home", "a:b", "a]b", "x y", "JPOS[]", "gr\xfcn", "q'q", "-1", "UF 0"])
NUMBERS = st.floats(-9999, 9999, allow_nan=False)
SPEEDS = st.sampled_from(
    [
        "5%",
        "100mm/sec",
        "12.5sec",
        ".5inch/min",
        "250cm/min",
        "30 deg/sec",
        "500msec",
        "R[3]mm/sec",
        "R[3:v]x]mm/sec",
        "R[R[2]]%",
        "AR[1]mm/sec",
        "WELD_SPEED",
        "max_speed",
    ]
)
ENDS = st.sampled_from(["FINE", "CNT0", "CNT100", "CNT R[8:c]", "CNT R[1]", "CR20", "CD 5"])
OPTIONS = st.lists(
    st.sampled_from(["ACC50", "Offset,PR[3:a:b]", "INC", "Wjnt", "TB    .10sec,P-SPS", "PTH", "Skip,LBL[1]", "RTCP"]),
    max_size=2,
)
OPAQUE = st.sampled_from(
    [
        "  !remark\n    :  L P[1] 7mm/sec FINE ;",
        "  !remark : with ] and ' ;",
        "  --eg:group\n    :  A POINT ;",
        "  IF R[1:L P]<5 AND\n    :  R[2]>3,JMP LBL[1] ;",
        "  CALL OTHER(1,'P[1]') ;",
        "  R[5:J P[1]]=R[6]+1 ;",
        "  PR[5:next]=P[1] ;",
        "  ; L P[1] 7mm/sec FINE",
        "  WAIT    .50(sec) ;\n     ------",
        "",
    ]
)


@cache
def among(*values):
    """One of some values; hypothesis looks over each strategy that is built, which takes longer than to draw of it."""
    return st.sampled_from(values)


@st.composite
def printed_number(draw):
    style = draw(st.integers(0, 6))
    if style == 0:
        return "*" * draw(st.integers(1, 9))
    if style == 1:
        return str(round(draw(NUMBERS)))
    text = f"{draw(NUMBERS):.{draw(among(1, 2, 3, 3, 6))}f}"
    if style == 2 and "0." in text:
        text = text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
    return text.rjust(draw(among(1, 9, 12)))


PRINTED_NUMBER = printed_number()


def units_of(axis, group):
    """Units that an axis may have."""
    if axis.lstrip("R") in ("X", "Y", "Z"):
        return ["mm"]
    if axis in ("W", "P", "R", "RW", "RP", "RR") or (group == 1 and axis in ("J1", "J2", "J3", "J4", "J5", "J6")):
        return ["deg"]
    return ["mm", "deg"]


@st.composite
def printed_group(draw, number):
    blank = draw(among("", " ", "\t", "  "))
    form = draw(among("cartesian", "joint", "remote"))
    frames = [draw(among("0", "1", "9", "F")) for _ in range(2)]
    text = f"   GP{number}:\n\tUF{blank}:{blank}{frames[0]}, UT{blank}:{blank}{frames[1]},\t"
    if form != "joint":
        names = ["X", "Y", "Z", "W", "P", "R"] if form == "cartesian" else ["RX", "RY", "RZ", "RW", "RP", "RR"]
        configs = ["N U T, 0, 0, 0", "F D B, -1, 0, 1", "", "R, 0, 0, 0", "N   U  T, 0,0,0"]
        text += f"\tCONFIG{blank}:{blank}'{draw(among(*configs))}',"
    else:
        names = [f"J{i}" for i in range(1, draw(st.integers(1, 9)) + 1)]
    names += ["E1", "E2", "E3"][: draw(st.integers(0, 3))]
    for i, axis in enumerate(names):
        unit = draw(among(*units_of(axis, number), ""))
        gap = draw(among("", " ", "\t"))
        comma = "" if i == len(names) - 1 else draw(among(",", ", ", ",\t"))
        text += draw(among("\n", "\n\t", "\t", " ")) + f"{axis}{gap}={gap}{draw(PRINTED_NUMBER)}{gap}{unit}"
        text += comma
    return text + draw(among("\n", "", " "))


@st.composite
def printed_move(draw, number):
    blanks = among(" ", "  ", "\t")
    target = st.one_of(
        st.builds("P[{}{}]".format, st.integers(1, 300), NAMES.map(lambda n: f":{n}" if n else "")),
        among("PR[1]", "PR[2:a]b]", "P[R[5]]", "PR[GP2:4]", "PR[R[R[1]]]", "PAL_1[A_1]", "PAL_12[BTM]"),
    )
    letter = draw(among(*"JLLLCAS"))
    text = letter + draw(blanks) + draw(target)
    if letter == "C":
        text += draw(among(" ", "    \n    :  ", "\n:")) + draw(target)
    words = [draw(SPEEDS), draw(ENDS), *draw(OPTIONS)]
    blanks = among(" ", "  ", "\t", *(["    \n    :  "] if letter == "C" else []))  # over several lines
    before = draw(among("", "  ", " ", "  //", "  // "))
    text = before + text + "".join(draw(blanks) + word for word in words)
    ends = ["    ;", ";", " ; note: J P[1] 5% FINE", *([] if letter == "C" else [""])]
    return f"{number}:{text}{draw(among(*ends))}"


@st.composite
def programs(draw):
    text = draw(among("", "\n", "  \n")) + "/PROG  " + draw(among("GEN", "-X_1\t  Macro")) + "\n/ATTR\n"
    text += draw(among("", 'OWNER\t\t= MNEDITOR;\nCOMMENT\t\t= "any ; text";\n'))
    text += draw(among("", "/APPL\n  A : B;\n", "/APPL\n/APPL\n  L P[1] 5mm/sec FINE ;\n")) + "/MN\n"
    number = draw(among(0, 9997))
    for _ in range(draw(st.integers(0, 6))):
        number += draw(among(1, 1, 1, 5, -3))
        label = f"{max(number, 1):4d}"
        text += draw(st.one_of(printed_move(label), OPAQUE.map(f"{label}:{{}}".format))) + "\n"
    text += "/POS" + draw(among("", "  ")) + "\n"
    for n in sorted(draw(st.sets(st.integers(1, 2500), max_size=4))):
        name = draw(NAMES)
        title = f"{n}" if not name and draw(st.booleans()) else f'{n}:"{name}"'
        text += f"P[{title}]" + draw(among("{", " {", "\t{ ")) + draw(among("\n", ""))
        for group in draw(st.permutations([1, 2]))[: draw(st.integers(1, 2))]:
            text += draw(printed_group(group))
        text += draw(among("};\n", "}\n", "} ;\n"))
    text += draw(among("/END", "/END\n", "/END.\n", "/END\n\n \t\n\x1a"))
    end = draw(among("\n", "\r\n", "mixed"))
    if end == "mixed":
        lines = text.split("\n")
        text = "".join(line + ("\r\n" if i % 3 else "\n") for i, line in enumerate(lines[:-1])) + lines[-1]
        return text.encode("latin-1")
    return text.replace("\n", end).encode("latin-1")
