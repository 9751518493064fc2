"""What is measured: compgen's parts and the obvious ways to do the same, on the same inputs."""

import subprocess
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.measure import seconds
from compgen.compensation import nonlinear_program, optimise
from compgen.compensation.problem import Optimum, Problem, Settings
from compgen.core import evaluation
from compgen.core.rotations import rotation_vector_expr
from compgen.error_model.model import ErrorModel
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned.job_results import Planned
from compgen.planning import retiming

PATH = "paths/optic_spiral.toml"
HERE = Path(__file__).parent


def quiet(stage: str, share: float) -> None:
    """Says nothing."""


def overrides_of(points: int) -> list[str]:
    """What makes the optic's spiral about so many waypoints long."""
    return [f"path.stepover_mm={1.609e6 / points:.6g}", "process.chord_um=0.2"]


def job_of(points: int, robot: str | None = None) -> Job:
    """The optic's spiral with about so many waypoints."""
    return load_job(PATH, robot, overrides_of(points))


def problem_of(planned: Planned) -> Problem:
    """What the optimiser is asked."""
    job, path = planned.job, planned.path
    return Problem(
        robot=job.robot,
        model=planned.model,
        posture=job.posture,
        tool=job.tool.pose,
        target=path.target,
        theta=planned.theta,
        rise=planned.rise,
        arc=path.arc,
        stop=path.stop,
    )


def hot(model: ErrorModel) -> Any:
    """The hot residual (6) and its Jacobian in the joints (6, 6), as one CasADi function."""
    theta, p, r = ca.SX.sym("theta", 6), ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    others = [ca.SX.sym(f"x{k}", model.actual.size1_in(k)) for k in range(1, model.actual.n_in())]
    position, rotation = model.actual(theta, *others)
    e = ca.vertcat(position - p, rotation_vector_expr(ca.reshape(r, 3, 3) @ rotation))
    return ca.Function("hot", [theta, *others, p, r], [e, ca.densify(ca.jacobian(e, theta))])


def unit(problem: Problem, rows: int = 20_000) -> tuple[float, int]:
    """One scalar evaluation of the hot residual and its Jacobian, generated C, mapped in C [s]; its operations."""
    function = hot(problem.model)
    return compiled_scalar(function, rows), int(function.n_instructions())


def full_robot(folder: Path) -> str:
    """The shipped robot with every kind of error, as a robot file."""
    file = folder / "full.toml"
    file.write_text(Path("robots/m710ic50.toml").read_text() + "\n" + (HERE / "errors.toml").read_text())
    return str(file)


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
            buffer.set_arg(k, memoryview(values))  # type: ignore[call-arg, arg-type]  # its stub knows C's pointers alone
        for k, values in enumerate(outs):
            buffer.set_res(k, memoryview(values))  # type: ignore[call-arg, arg-type]  # as above
        return seconds(call) / rows


def correction(problem: Problem, compiler: Any) -> dict[str, float]:
    """The whole correction of a waypoint, inverse kinematics included [s]."""
    rows = len(problem.arc)
    found = {"vectorised": seconds(problem.pointwise_correction) / rows}
    evaluation.configure(None)
    found["no compiler"] = seconds(problem.pointwise_correction) / rows
    evaluation.configure(compiler)
    found["compiled scalar"] = compiled_scalar(problem._functions().pointwise, 20_000)
    found["with smoothing"] = seconds(lambda: optimise.optimise(problem, Settings())) / rows
    tight = clamped(problem, 0.99)
    found["limited"] = seconds(lambda: optimise.optimise(problem, tight)) / rows
    found["at a limit"] = len({n for n, _ in optimise.optimise(problem, tight).active_limits}) / rows
    return found


def clamped(problem: Problem, share: float) -> Settings:
    """A clamp that this share of the waypoints keeps without being asked to."""
    free = optimise.optimise(problem, Settings())
    return Settings(clamp_position=float(np.quantile(np.linalg.norm(free.correction[:, :3], axis=1), share)))


def against_ipopt(problem: Problem, points: int) -> dict[str, float]:
    """The general program and the fast one on the same stretch, free and with a limit [s a waypoint]."""
    part = problem.window(slice(len(problem.arc) // 2, len(problem.arc) // 2 + points))
    everywhere = np.ones(points, dtype=bool)
    measured: dict[str, float] = {}
    for name, settings in (("free", Settings()), ("limited", clamped(part, 0.99))):
        fast = optimise.optimise(part, settings)
        slow: list[Optimum] = []

        def general(settings: Settings = settings, slow: list[Optimum] = slow) -> None:
            slow.append(nonlinear_program.solve(part, settings, np.zeros((points, 6)), everywhere))

        measured[f"{name} slow"] = seconds(general) / points
        measured[f"{name} fast"] = seconds(partial(optimise.optimise, part, settings)) / points
        measured[f"{name} difference"] = float(np.abs(slow[-1].correction - fast.correction)[:, :3].max())
        measured[f"{name} solved"] = float(slow[-1].converged)
    return measured


def timed(planned: Planned, points: int) -> tuple[float, dict[str, Any]]:
    """compgen's timing of so many waypoints [s a waypoint], and the same question for a peer."""
    first = (len(planned.theta) - points) // 2
    rows = slice(first, first + points)
    arc, theta = planned.path.arc[rows] - planned.path.arc[first], planned.theta[rows]
    stop = np.zeros(points, dtype=bool)
    stop[[0, -1]] = True
    robot = planned.job.robot
    mine = seconds(lambda: retiming.retime(robot, arc, theta, stop, planned.feed)) / points
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
