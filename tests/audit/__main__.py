"""``python -m tests.audit OUTPUT [PATH_FILE [ROBOT_FILE]]``: exit 0 when all agrees, 1 when not, 2 when not judged."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # where other judges' readers stand, too

from naive_arm import UnreachableError

from audit.curves import OffCurveError
from audit.judge import audit
from audit.listing import UnreadableError
from audit.scope import NotJudgedError

USAGE = (
    "audit: give an output folder of cgen generate, where it is not paths/<name>.toml the path file, and of an "
    "identified robot its file"
)


def main(arguments):
    """Prints the table; the exit code."""
    if not 1 <= len(arguments) <= 3 or arguments[0].startswith("-"):
        print(USAGE, file=sys.stderr)
        return 2
    try:
        name, checks = audit(Path(arguments[0]), *arguments[1:])
    except NotJudgedError as sentence:
        print(f"audit: {sentence}", file=sys.stderr)
        return 2
    except (OffCurveError, UnreachableError, UnreadableError) as problem:
        print(f"audit: OUTSIDE: {problem}", file=sys.stderr)
        return 1
    except (KeyError, TypeError, ValueError) as problem:
        print(f"audit: OUTSIDE: not what cgen generate writes: {problem!r}", file=sys.stderr)
        return 1
    print(f"{name}\n{'':42s}{'audit':>14s}{'output':>14s}{'apart':>11s}{'allowed':>11s}")
    for c in checks:
        verdict = "" if c.kept else "  OUTSIDE"
        print(f"{c.what:42s}{c.audit:14.6g}{c.output:14.6g}{c.apart:11.2g}{c.allowed:11.2g}{verdict}")
    failed = sum(not c.kept for c in checks)
    print(f"{failed} of {len(checks)} checks outside" if failed else f"all {len(checks)} checks agree")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
