"""Programs for tests, composed line by line."""

import numpy as np
from naive_arm import config, flange, numbers


def cartesian(n, values, uf=0, ut=0, letters="N U T, 0, 0, 0", form="{:.3f}", more="", name=""):
    """A position by X Y Z W P R."""
    quoted = f':"{name}"' if name else ""
    x, y, z, w, p, r = (v if isinstance(v, str) else form.format(v) for v in values)
    return (
        f"P[{n}{quoted}]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\tCONFIG : '{letters}',\n"
        f"\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,\n\tW = {w} deg,\tP = {p} deg,\tR = {r} deg{more}\n}};\n"
    )


def joint_form(n, joints, uf=0, ut=0, form="{:.3f}"):
    """A position by J1 to J6."""
    texts = [f"J{i}= {form.format(v)} deg" for i, v in enumerate(joints, 1)]
    return f"P[{n}]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\n\t{', '.join(texts[:3])},\n\t{', '.join(texts[3:])}\n}};\n"


def at(n, joints, uf=None, ut=None, numbered=(0, 0), **how):
    """A Cartesian position where pendant angles bring the tool; ``uf`` and ``ut`` are matrices."""
    world = flange(joints) @ (np.eye(4) if ut is None else ut)
    local = np.linalg.inv(np.eye(4) if uf is None else uf) @ world
    frame, tool = numbered
    return cartesian(n, numbers(local), frame, tool, letters=config(joints), **how)


def program(moves, points, name="T", head="", end="\n"):
    """A whole file; moves are statements without number and semicolon, a list; points are texts."""
    body = "".join(f"{i:4d}:{m if m[:2] in ('J ', 'L ', 'C ') else '  ' + m} ;\n" for i, m in enumerate(moves, 1))
    text = f"/PROG  {name}\n/ATTR\n{head}/MN\n{body}/POS\n{''.join(points)}/END\n"
    return text.replace("\n", end).encode("latin-1")
