"""What is measured: compgen's parts and the obvious ways to do the same, on the same inputs."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from benchmarks.measure import seconds
from compgen import compensate, evaluation, limits, pipeline, timing
from compgen.config import load_job
from compgen.dialects import fanuc_ls
from compgen.dialects.fanuc_ls.write import speed_text
from compgen.job import Job
from compgen.pipeline import Planned
from compgen.problem import Problem, Settings
from compgen.rotations import rotation_vector_expr, to_wpr
from compgen.units import DEG, MM

PATH = "paths/optic_spiral.toml"


def quiet(stage: str, share: float) -> None:
    """Says nothing."""


def job_of(*overrides: str) -> Job:
    """The optic's spiral."""
    return load_job(PATH, None, list(overrides))


def problem_of(planned: Planned) -> Problem:
    """What the optimiser is asked."""
    job, path = planned.job, planned.path
    return Problem(
        job.robot, planned.model, job.posture, job.tool_position, job.tool_rotation,
        path.position, path.rotation, planned.theta, planned.rise, path.arc, path.stop,
    )  # fmt: skip


def unit(problem: Problem, rows: int = 20_000) -> float:
    """One scalar evaluation of the hot residual and its Jacobian, generated C, mapped in C [s]."""
    theta, p, r = ca.SX.sym("theta", 6), ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    others = [ca.SX.sym(f"x{k}", problem.model.actual.size1_in(k)) for k in range(1, problem.model.actual.n_in())]
    position, rotation = problem.model.actual(theta, *others)
    e = ca.vertcat(position - p, rotation_vector_expr(ca.reshape(r, 3, 3) @ rotation))
    hot = ca.Function("hot", [theta, *others, p, r], [e, ca.densify(ca.jacobian(e, theta))])
    return compiled_scalar(hot, rows)


def compiled_scalar(function: Any, rows: int) -> float:
    """Seconds a row of CasADi's own C of a function, mapped, called once through a buffer."""
    with tempfile.TemporaryDirectory() as folder:
        function.generate("f.c", {"with_header": False})
        Path("f.c").replace(Path(folder) / "f.c")
        library = str(Path(folder) / "f.so")
        subprocess.run(
            ["cc", "-O3", "-march=native", "-fPIC", "-shared", str(Path(folder) / "f.c"), "-o", library, "-lm"],
            check=True,
        )
        mapped = ca.external(function.name(), library).map(rows)
        rng = np.random.default_rng(0)
        ins = [np.ascontiguousarray(rng.uniform(0.1, 1, (rows, function.size1_in(k)))) for k in range(function.n_in())]
        outs = [np.zeros((rows, function.numel_out(k))) for k in range(function.n_out())]
        buffer, call = mapped.buffer()
        for k, values in enumerate(ins):
            buffer.set_arg(k, memoryview(values))
        for k, values in enumerate(outs):
            buffer.set_res(k, memoryview(values))
        return seconds(call) / rows


def correction(problem: Problem, compiler: Any) -> dict[str, float]:
    """The whole correction of a waypoint, inverse kinematics included [s]."""
    rows = len(problem.arc)
    evaluation.use(compiler)
    found = {"vectorised": seconds(problem.pointwise) / rows}
    evaluation.use(None)
    found["no compiler"] = seconds(problem.pointwise) / rows
    found["compiled scalar"] = compiled_scalar(problem._functions().pointwise, 20_000)
    evaluation.use(compiler)
    whole = seconds(lambda: compensate.optimise(problem, Settings())) / rows
    found["with smoothing"] = whole
    tight = clamped(problem, 0.99)
    solution = compensate.optimise(problem, tight)
    found["limited"] = seconds(lambda: compensate.optimise(problem, tight), 3) / rows
    found["at a limit"] = len({n for n, _ in solution.active}) / rows
    return found


def clamped(problem: Problem, share: float) -> Settings:
    """A clamp that this share of the waypoints keeps without being asked to."""
    free = compensate.optimise(problem, Settings())
    return Settings(clamp_position=float(np.quantile(np.linalg.norm(free.correction[:, :3], axis=1), share)))


def against_ipopt(problem: Problem, points: int) -> dict[str, float]:
    """The general program and the fast one on the same stretch, free and with a limit [s a waypoint]."""
    part = problem.window(slice(len(problem.arc) // 2, len(problem.arc) // 2 + points))
    everywhere = np.ones(len(part.arc), dtype=bool)
    found: dict[str, float] = {}
    for name, settings in (("free", Settings()), ("limited", clamped(part, 0.99))):
        fast = compensate.optimise(part, settings)
        begin = time.process_time()
        answer = limits.solve_stretch(part, settings, np.zeros((points, 6)), everywhere)
        found[f"{name} slow"] = (time.process_time() - begin) / points
        found[f"{name} fast"] = seconds(lambda settings=settings: compensate.optimise(part, settings)) / points
        found[f"{name} difference"] = float(np.abs(answer[0] - fast.correction)[:, :3].max())
    return found


def per_waypoint(problem: Problem, count: int = 30) -> dict[str, float]:
    """scipy's least squares and pinocchio's closed loop in Python, waypoint by waypoint [s]."""
    rows = np.linspace(10, len(problem.arc) - 10, count).astype(int)
    robot = problem.robot
    model, actual = pin.Model(), problem.model.actual
    parent = 0
    for i in range(6):
        place = pin.SE3(pin.utils.rotate("x", float(robot.alpha[i - 1])) if i else np.eye(3), np.zeros(3))
        if i:
            place.translation = np.array([robot.a[i - 1], 0, 0]) + (
                pin.utils.rotate("x", 0.0) @ np.array([0, 0, robot.d[i - 1]])
            )
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{i}")
    data = model.createData()
    rest = [np.zeros((1, actual.size1_in(k))) for k in range(2, actual.n_in())]

    def scipy_way() -> None:
        for n in rows:

            def residual(q: Any, n: int = n) -> Any:
                p, R = actual(q, problem.rise[n], *rest)
                turn = pin.log3(problem.rotation[n].T @ np.asarray(R))
                return np.concatenate([np.asarray(p).ravel() - problem.position[n], turn])

            least_squares(residual, problem.theta[n], xtol=1e-12, ftol=1e-12, gtol=1e-12)

    def closed_loop() -> None:
        for n in rows:
            pin.forwardKinematics(model, data, problem.theta[n])
            goal = data.oMi[6].copy()
            q = problem.theta[n] + 1e-3
            for _ in range(50):
                pin.forwardKinematics(model, data, q)
                error = pin.log6(data.oMi[6].actInv(goal)).vector
                if np.linalg.norm(error) < 1e-12:
                    break
                J = pin.computeJointJacobian(model, data, q, 6)
                q = pin.integrate(model, q, np.linalg.solve(J, error))

    return {"scipy": seconds(scipy_way, 3) / count, "pinocchio": seconds(closed_loop, 3) / count}


def text(job: Job, compiler: Any) -> dict[str, float]:
    """Writing and reading a program line by line, and as compgen does [s a position]."""
    evaluation.use(compiler)
    _, done = pipeline.generate(job, quiet, pages=False)
    program, data = done.program, done.text
    rows = len(program.position)

    def write() -> bytes:
        w, p, r = (angle / DEG for angle in to_wpr(program.rotation))
        lines = []
        for n in range(1, rows):
            end = "FINE" if program.fine[n] else "CNT100"
            lines.append(f"{n + 8:4d}:L P[{n + 1}] {speed_text(program.speed[n - 1])} {end}    ;\r\n")
        for n in range(rows):
            x, y, z = program.position[n] / MM
            a, b, c = program.turns[n]
            lines.append(
                f"P[{n + 1}]{{\r\n   GP1:\r\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, {a}, {b}, {c}',\r\n"
                f"\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm,\r\n"
                f"\tW = {w[n]:9.3f} deg,\tP = {p[n]:9.3f} deg,\tR = {r[n]:9.3f} deg\r\n}};\r\n"
            )
        return "".join(lines).encode()

    def read() -> list[Any]:
        import re

        number = re.compile(r"[XYZWPR] =\s*(-?\d+\.\d+)")
        move = re.compile(r"\s*\d+:([JL]) P\[(\d+)\] ([\d.]+)(\S+) (FINE|CNT\d+)")
        moves, points = [], []
        for line in data.decode().splitlines():
            if found := move.match(line):
                moves.append((found[1], int(found[2]), float(found[3]), found[4], found[5]))
            elif line.startswith("\t") and "=" in line:
                points += [float(v) for v in number.findall(line)]
        return [moves, np.array(points).reshape(-1, 6)]

    return {
        "write fast": seconds(lambda: fanuc_ls.compose(program)) / rows,
        "write slow": seconds(write, 3) / rows,
        "read fast": seconds(lambda: fanuc_ls.interpret(data)) / rows,
        "read slow": seconds(read, 3) / rows,
    }


def timed(planned: Planned, points: int) -> tuple[float, dict[str, Any]]:
    """compgen's timing of so many waypoints [s a waypoint], and the same question for a peer."""
    rows = slice(1000, 1000 + points)
    arc, theta = planned.path.arc[rows] - planned.path.arc[1000], planned.theta[rows]
    stop = np.zeros(points, dtype=bool)
    stop[[0, -1]] = True
    robot = planned.job.robot
    mine = seconds(lambda: timing.retime(robot, arc, theta, stop, planned.feed)) / points
    return mine, {
        "arc": arc.tolist(), "path": theta.tolist(), "speed": robot.speed.tolist(),
        "acceleration": robot.acceleration.tolist(),
    }  # fmt: skip


def arm_question(planned: Planned) -> dict[str, Any]:
    """The arm, cold and grown, as rows of d, a, alpha, and some joints."""
    robot = planned.job.robot
    grown = 1 + 11e-6 * 10
    rows = np.linspace(10, len(planned.theta) - 10, 50).astype(int)
    cold = np.column_stack([robot.d, robot.a, robot.alpha])
    hot = cold * [grown, grown, 1.0]
    return {"cold": cold.tolist(), "hot": hot.tolist(), "theta": planned.theta[rows].tolist()}


GROWTH = """
import resource, sys, time
from pathlib import Path
from compgen import evaluation, pipeline
from compgen.config import load_job
from compgen.report import report_html, report_json, waypoints_csv
evaluation.use(evaluation.find_compiler(Path(sys.argv[1])), int(sys.argv[2]))
folder = Path(sys.argv[3])
def run(*overrides):
    job = load_job("paths/optic_spiral.toml", None, list(overrides))
    begin, spent = time.perf_counter(), time.process_time()
    planned, done = pipeline.generate(job, lambda stage, share: None, pages=False)
    files = [report_json(planned, done), waypoints_csv(planned, done), report_html(planned, done), done.text]
    for n, content in enumerate(files):
        (folder / str(n)).write_bytes(content)
    return len(planned.path.arc), time.perf_counter() - begin, time.process_time() - spent
run("path.stepover_mm=200")
for sizes in sys.argv[4:]:
    print(*run(*sizes.split(",")), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""


def growth(cache: Path, workers: int, sizes: list[str]) -> list[list[float]]:
    """Waypoints, elapsed and processor seconds, peak MB of whole runs in one process, the start taken off."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", GROWTH, str(cache), str(workers), folder, *sizes],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    return [[float(v) for v in line.split()] for line in done.stdout.splitlines()]


def cold_start(cache: Path) -> tuple[float, float]:
    """Processor seconds of a short job from the shell with a warm cache, and of importing what it stands on."""
    import os
    import resource

    def spent(*call: str) -> float:
        environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
        found = []
        for _ in range(4):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, *call], check=True, capture_output=True, env=environment)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return sorted(found[1:])[1]

    with tempfile.TemporaryDirectory() as folder:
        job = spent("-m", "compgen", "generate", "paths/spiral_1300.toml", "-q", "-o", f"{folder}/o")
    return job, spent("-c", "import casadi, pinocchio, scipy")
