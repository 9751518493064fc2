"""``python -m benchmarks``: everything side by side, as ratios; writes benchmarks/results.md."""

import argparse
import os
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from benchmarks import cases, peers  # noqa: E402
from benchmarks.measure import ROUNDS, machine  # noqa: E402
from compgen import evaluation, pipeline  # noqa: E402

HERE = Path(__file__).parent


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument(
        "--folder", default=str(Path.home() / ".cache" / "compgen-benchmarks"), help="peers, compiled code"
    )
    parser.add_argument("--no-peers", action="store_true", help="only what is installed here")
    parser.add_argument("--ipopt", type=int, default=10_000, help="waypoints for the general program")
    parser.add_argument("--points", type=int, default=1_000_000, help="waypoints of the largest whole run")
    given = parser.parse_args()
    folder = Path(given.folder)
    folder.mkdir(parents=True, exist_ok=True)
    compiler = evaluation.find_compiler(folder / "compiled")
    evaluation.use(compiler)
    rows: list[tuple[str, str, str]] = []

    def row(what: str, reach: str, value: str) -> None:
        rows.append((what, reach, value))
        print(f"{what:<78} {reach:>14} {value:>24}", flush=True)

    planned = pipeline.predict(cases.job_of("process.chord_um=0.4"), cases.quiet)
    problem = cases.problem_of(planned)
    unit = cases.unit(problem)
    row("unit: compiled scalar hot residual and Jacobian", "1", f"1 ({1e9 * unit:.0f} ns here)")
    c = cases.correction(problem, compiler)
    row("correction of a waypoint, compiled scalar, in units", "<= 2", f"{c['compiled scalar'] / unit:.2f}")
    row("correction, vectorised", "<= 0.4", f"{c['vectorised'] / unit:.2f}")
    row("correction, no compiler", "<= 4", f"{c['no compiler'] / unit:.2f}")
    row("smoothing, nothing active", "<= + 1", f"+ {(c['with smoothing'] - c['vectorised']) / unit:.2f}")
    told = f"+ {(c['limited'] - c['vectorised']) / unit:.2f} ({100 * c['at a limit']:.1f} % at it)"
    row("smoothing, 1 % of waypoints at a limit", "<= + 8", told)

    stepover = 826 * 2 / 0.8 / given.points * 1e3  # mm, at 0.8 mm between waypoints
    sizes = [f"path.stepover_mm={stepover * k:.6g},process.chord_um=0.2" for k in (100, 10, 1)]
    small, middle, large = cases.growth(folder / "compiled", min(2, os.cpu_count() or 1), sizes)
    row(
        f"whole generate at {large[0]:.0f} waypoints, elapsed, in units a waypoint",
        "<= 20",
        f"{large[1] / large[0] / unit:.1f}",
    )
    row("the same in processor time", "", f"{large[2] / large[0] / unit:.1f}")
    # differences of sizes know no start-up
    late, early = ((b[2] - a[2]) / (b[0] - a[0]) for a, b in ((middle, large), (small, middle)))
    told = (
        f"growth: processor time a waypoint, {middle[0]:.0f} to {large[0]:.0f} over {small[0]:.0f} to {middle[0]:.0f}"
    )
    row(told, "<= 1.1", f"{late / early:.2f}")
    row("start-up beside, in processor seconds", "", f"{small[2] - small[0] * early:.2f}")
    row(f"peak memory at {large[0]:.0f}", "<= 2000 MB", f"{large[3]:.0f} MB")
    job, base = cases.cold_start(folder)
    row("generate paths/spiral_1300.toml over importing casadi, pinocchio, scipy", "<= 3", f"{job / base:.1f}")

    one = c["vectorised"]
    others = cases.per_waypoint(problem)
    row("scipy least_squares over compgen's correction", ">= 1000", f"{others['scipy'] / one:.0f}")
    row("pinocchio closed loop in Python (cold) over compgen's correction", "", f"{others['pinocchio'] / one:.0f}")
    t = cases.text(cases.job_of("process.chord_um=0.4"), compiler)
    row("per-line LS writer over compgen", ">= 5", f"{t['write slow'] / t['write fast']:.1f}")
    row("per-line LS reader over compgen", ">= 8", f"{t['read slow'] / t['read fast']:.1f}")
    points = min(5000, len(planned.theta) - 1001)
    mine, question = cases.timed(planned, points)
    if not given.no_peers:
        arm = cases.arm_question(planned)
        for name, asked, wanted in (
            (
                "roboticstoolbox",
                arm,
                (("ikine_LM", "DHRobot.ikine_LM (hot)", ">= 1000"), ("ik_LM", "ETS.ik_LM (cold)", ">= 15")),
            ),
            ("pybotics", arm, (("ik", "ik (hot)", ""),)),
            ("toppra", question, (("timing", "timing", ">= 20"),)),
        ):
            answer = peers.ask(name, asked, folder)
            for key, label, reach in wanted:
                if isinstance(answer, str):
                    row(f"{name} {label}", reach, answer)
                else:
                    row(
                        f"{name} {label} over compgen", reach, f"{answer[key] / (mine if key == 'timing' else one):.0f}"
                    )
    if given.ipopt:
        i = cases.against_ipopt(problem, min(given.ipopt, len(problem.arc) // 2 - 1))
        for name, reach in (("free", ">= 500"), ("limited", ">= 30")):
            told = f"{i[f'{name} slow'] / i[f'{name} fast']:.0f} (apart {i[f'{name} difference']:.0e} m)"
            row(f"ipopt over compgen, {given.ipopt} waypoints, {name}", reach, told)

    told = f"- medians of {ROUNDS} warm rounds, processor time unless said; ratios taken in one run"
    lines = [
        "# Results",
        "",
        *(f"- {fact}" for fact in machine()),
        told,
        "",
        "| what | reach | here |",
        "|---|---|---|",
    ]
    lines += [f"| {what} | {reach} | {value} |" for what, reach, value in rows]
    (HERE / "results.md").write_text("\n".join(lines) + "\n")


main()
