"""Long programs of other people: text from statements."""

HEAD = (
    '/PROG  LONG\n/ATTR\nCOMMENT\t\t= "a long one";\nLINE_COUNT\t= 99;\nDEFAULT_GROUP\t= 1,*,*,*,*;\n'
    "/APPL\n  CORNER_SPEED_HEADER;\n/MN\n"
)


def text(body, places=9, frame=1, end="\r\n", numbered=True):
    """A program from its statements; P[1] to P[places] exist."""
    lines = []
    for n, statement in enumerate(body, 1):
        first, *more = statement.split("\n")
        lines += [f"{n:4d}:{first}" if numbered else f"    :{first}", *(f"    :{m}" for m in more)]
        lines[-1] += " ;"
    blocks = [
        f"P[{n}]{{\n   GP1:\n\tUF : {frame}, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX = {100 + n:9.3f}  mm,\tY =      .5    mm,\tZ = {n:9.3f}  mm,\n"
        "\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg\n};\n"
        for n in range(1, places + 1)
    ]
    whole = HEAD + "\n".join(lines) + "\n/POS\n" + "".join(blocks) + "/END\n"
    return whole.replace("\n", end).encode()


def move(n, stop=True, rest="", letter="L", speed="100mm/sec"):
    return f"{letter} P[{n}] {speed} {'FINE' if stop else 'CNT100'}{rest}   "
