"""Robot files that are not the arm's: each must be refused, by name of what is wrong where the places show it.

python tests/campaigns/wrong_files.py --seeds 0:3

The cold campaign of ``arms.py``, read with a file in which one thing is wrong: the sign of an axis, the coupling of J2
and J3 left out or reversed, lengths exchanged, of another row, in inches or 50 mm longer, an alpha of the other sign,
an IRB 120's file or a UR5's.
"""

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "campaigns")]

import arms  # noqa: E402
import seed_journal  # noqa: E402

from compgen.core.exceptions import CompgenError  # noqa: E402
from compgen.core.finding_codes import Level  # noqa: E402
from compgen.pipelines.files.robot_file import load_arm  # noqa: E402
from compgen.pipelines.measure.identification_files import MeasurementFiles, read_measurements  # noqa: E402

D, A = "d_mm = [0, 0, 0, -1016, 0, -175]", "a_mm = [150, 870, 170, 0, 0, 0]"
ALPHA = "alpha_deg = [-90, 180, -90, 90, -90, 180]"
COUPLING = "[0, 1, 1, 0, 0, 0]"


def unit_row(k, sign):
    return "[" + ", ".join(str(sign * (i == k)) for i in range(6)) + "]"


def of_axis(k):
    """J3's row is the coupled one."""
    return (COUPLING, "[0, 1, -1, 0, 0, 0]") if k == 2 else (unit_row(k, 1), unit_row(k, -1))


#: what is wrong, what stands in the file, what stands there instead, and what the refusal names
WRONG = [
    *((f"sign of J{k + 1}", *of_axis(k), f"J{k + 1}") for k in range(6)),
    ("no coupling", COUPLING, "[0, 0, 1, 0, 0, 0]", "J3"),
    ("coupling of the other sign", COUPLING, "[0, -1, 1, 0, 0, 0]", "J3"),
    ("a1 and a3 exchanged", A, "a_mm = [170, 870, 150, 0, 0, 0]", "a1"),
    ("a1 longer by 50 mm", A, "a_mm = [200, 870, 170, 0, 0, 0]", "a1"),
    ("a2 of d4", A, "a_mm = [150, 1016, 170, 0, 0, 0]", "a2"),
    ("a2 in inches", A, "a_mm = [150, 34.25, 170, 0, 0, 0]", "a2"),
    ("d4 longer by 50 mm", D, "d_mm = [0, 0, 0, -1066, 0, -175]", "d4"),
    ("d4 of the other sign", D, "d_mm = [0, 0, 0, 1016, 0, -175]", ""),
    ("alpha1 of the other sign", ALPHA, "alpha_deg = [90, 180, -90, 90, -90, 180]", ""),
    ("alpha3 of the other sign", ALPHA, "alpha_deg = [-90, 180, 90, 90, -90, 180]", ""),
    ("alpha4 of the other sign", ALPHA, "alpha_deg = [-90, 180, -90, -90, -90, 180]", ""),
]
OTHERS = ("irb120", "ur5")


def refusal(robot, cold):
    """What identify says of a file of measurements; "" where it accepts."""
    try:
        arm = load_arm(robot)
        data, _ = read_measurements(arm, MeasurementFiles(poses=[cold]), force=False)
        result = arms.identify_arm(arm, data, False)
    except CompgenError as exception:
        return str(exception)
    return next((f.message for f in result.findings if f.level is Level.REFUSED), "")


def trial(seed):
    """One arm against all wrong files."""
    row = {"seed": seed, "wrong": [], "unnamed": []}
    with tempfile.TemporaryDirectory() as folder:
        right = Path(arms.robot_file(folder))
        site = arms.Site(seed, load_arm(str(right)).robot)
        cold, *_ = arms.campaign_files(site, seed, folder, ())
        file = Path(folder) / "wrong.toml"
        for what, old, new, name in WRONG:
            assert right.read_text().count(old) >= 1, old
            file.write_text(right.read_text().replace(old, new, 1))
            judge(row, what, refusal(str(file), cold), name)
        for other in OTHERS:
            judge(row, other, refusal(other, cold), "")
    return row


def judge(row, what, message, name):
    """Into the row: what was accepted, and what was refused without its name."""
    if not message:
        row["wrong"].append(what)
    elif name not in message:
        row["unnamed"].append([what, message])


def main():
    options = seed_journal.parser("wrong_files", __doc__, "0:3").parse_args()
    if not options.table:
        options.journal.keep_trials(options.seeds, options.budget, trial)
    rows = options.journal.rows(options.seeds)
    count = len(rows) * (len(WRONG) + len(OTHERS))
    accepted, unnamed = (sum(len(r[key]) for r in rows) for key in ("wrong", "unnamed"))
    print(f"{len(rows)} arms, {count} wrong files: accepted {accepted}, refused without the name {unnamed}")
    for row in rows:
        for what, message in row["unnamed"]:
            print(row["seed"], what, "|", message)


if __name__ == "__main__":
    main()
