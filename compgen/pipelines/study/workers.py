"""Scenarios to rows, over all cores of this machine or over a Dask cluster: the same rows, whoever computes them.

Path, joints, timing and the controller's execution depend on the geometry keys only and are made once for scenarios
that share them; heat, growth and the error are then a few array operations on its samples. A scenario that only changes
temperatures costs those.
"""

import multiprocessing
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import resource_tracker
from queue import SimpleQueue
from typing import Any

from compgen.core import interrupts
from compgen.core.exceptions import CompgenError, InputError
from compgen.core.finding_codes import Level
from compgen.core.findings import first_message
from compgen.core.unique_rows import grouped
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.planned import generate
from compgen.pipelines.study.geometry import Geometry, band_at_samples, execute_with, plan_geometry
from compgen.pipelines.study.scenarios import Scenario, Study
from compgen.thermal.model import extrapolations
from compgen.verification.deviation import Deviation, deviation_from_path, statistics

StudyRow = dict[str, Any]
KEPT = 4  # geometries at a time
#: tables whose keys leave path, joints and timing alone: what the cell did, and what comes of it
OF_DAY = ("before", "cycle", "after", "shift", "start", "ambient", "log")
WARM = (*OF_DAY, "bounds", "compensation", "title", "robot.thermal")
RUN_IN = ("compensation", "compensation.rate_um_mm")  # but for these: how early sweeps begin, where joints have play
CHUNK = 20  # scenarios of one geometry that go to a worker together
ANSWER = 10.0  # [s] that a cluster has to answer


class Shared:
    """Geometries by their keys; the last few are kept."""

    def __init__(self) -> None:
        """With none yet."""
        self._kept: OrderedDict[tuple[tuple[str, str], ...], Geometry | CompgenError] = OrderedDict()

    def of(self, scenario: Scenario, job: Job) -> Geometry:
        """The geometry of a scenario.

        Raises:
            CompgenError: The robot cannot drive it.
        """
        key = geometry_key(scenario)
        if key not in self._kept:
            try:
                self._kept[key] = plan_geometry(job)
            except CompgenError as failure:
                self._kept[key] = failure
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        geometry = self._kept[key]
        if isinstance(geometry, CompgenError):
            raise geometry
        return geometry


def geometry_key(scenario: Scenario) -> tuple[tuple[str, str], ...]:
    """The values that path, joints and timing depend on."""
    return tuple(
        (k, v) for k, v in scenario.values if k in RUN_IN or not any(k == w or k.startswith(f"{w}.") for w in WARM)
    )


def evaluate(study: Study, scenario: Scenario, shared: Shared) -> StudyRow:
    """A scenario's row: its values with their results, or why it failed."""
    row: StudyRow = {"index": scenario.index, **{key: value.strip('"') for key, value in scenario.values}}
    try:
        job = load_job(study.path, study.robot, [*study.base, *scenario.overrides()])
        geometry = shared.of(scenario, job)
        execution = execute_with(job, geometry)
        before = deviation_from_path(geometry.path, [execution], len(execution.time))
        row |= {"state": "done"} | _statistics("before", before)
        row |= {
            "duration_s": _round(float(execution.time[-1])),
            "waypoints": len(geometry.path.arc),
        } | {f"start_{n}_K": _round(float(r)) for n, r in zip(job.heat.names, execution.rise[0], strict=True)}
        heat, duties, time = job.cell.heat, job.duties_before(), float(execution.time[-1])
        if beyond := extrapolations(heat, duties, job.feed, time, execution.rise, job.history.step_at):
            row["beyond_measured"] = "; ".join(beyond)
        band = band_at_samples(job, geometry)
        row["band_um"] = _round(band.largest / UM)
        if band.hidden:
            row["sensor_um"] = _round(band.hidden / UM)
        if study.correct:
            _, corrected = generate.generate(job, lambda stage, share: None)
            row |= _statistics("after", corrected.deviation)
            row["band_um"] = _round(corrected.band.largest / UM)  # its late starts count, too
            row |= {"inside": corrected.inside, "start_window_s": _round(corrected.start_window)}
            if not corrected.inside:
                row["reason"] = first_message(Level.OUTSIDE, corrected.findings)
    except CompgenError as failure:
        row |= {"state": "failed", "reason": " ".join(str(failure).split())}
    return row


def _statistics(side: str, deviation: Deviation) -> StudyRow:
    table = statistics(deviation)
    row = {f"{side}_{k}": _round(v) for k, v in table["total"].items()}
    row[f"{side}_normal_max_um"] = _round(table["normal"]["max_um"])
    row[f"{side}_on_part_max_um"] = _round(statistics(deviation, on_part=True)["total"]["max_um"])
    return row


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def run(
    study: Study,
    done: set[int],
    on_rows: Callable[[list[StudyRow]], None],
    workers: int,
    cluster: str | None = None,
) -> None:
    """Compute the scenarios that are not done.

    Args:
        study: Its scenarios.
        done: Indices that need no computing.
        on_rows: Called in this process with rows as they come, in no order.
        workers: Processes; 0: one for each core; 1: this process.
        cluster: Address of a Dask scheduler instead.

    Raises:
        InputError: The cluster does not answer, or Dask is not installed.
    """
    chunks = list(_chunks([s for s in study.scenarios if s.index not in done]))
    if cluster is not None:
        _on_cluster(study, chunks, on_rows, cluster)
    elif workers == 1 or len(chunks) == 1:
        shared = Shared()
        for chunk in chunks:
            for scenario in chunk:
                on_rows([evaluate(study, scenario, shared)])
    elif chunks:
        _on_cores(study, chunks, on_rows, workers or os.cpu_count() or 1)


def _chunks(todo: Sequence[Scenario]) -> Iterator[list[Scenario]]:
    """Scenarios of one geometry together, a few at a time, in the order of the study."""
    for group in grouped((geometry_key(scenario), scenario) for scenario in todo).values():
        for k in range(0, len(group), CHUNK):
            yield group[k : k + CHUNK]


def _on_cores(
    study: Study, chunks: list[list[Scenario]], on_rows: Callable[[list[StudyRow]], None], workers: int
) -> None:
    """Chunks over processes; this thread waits where Ctrl-C can interrupt it without leaving a lock of the pool taken.

    An interrupt in the pool's own waiting may come between taking a lock and noting that it was taken: the pool then
    never ends. So the pool's thread hands over what is done, and this one only takes it from a queue.
    """
    context = multiprocessing.get_context("spawn")
    results: SimpleQueue[tuple[list[StudyRow], BaseException | None]] = SimpleQueue()

    def hand_over(future: Future[list[StudyRow]]) -> None:
        if not future.cancelled():
            failure = future.exception()
            results.put(([], failure) if failure is not None else (future.result(), None))

    resource_tracker.ensure_running()  # begun by the pool's first lock, it would leave that lock behind on Ctrl-C
    with ProcessPoolExecutor(min(workers, len(chunks)), context, initializer=_begin, initargs=(study,)) as pool:
        try:
            with interrupts.block_sigint_in_children():
                for chunk in chunks:
                    pool.submit(_compute, chunk).add_done_callback(hand_over)
            for _ in chunks:
                rows, failure = results.get()
                if failure is not None:
                    raise failure
                on_rows(rows)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in multiprocessing.active_children():  # chunks at work are not waited for
                child.terminate()
            raise


_STUDIES: dict[str, tuple[Study, Shared]] = {}


def _begin(study: Study) -> None:
    """In each worker: the study, and an end when the main process is killed."""
    _STUDIES["study"] = (study, Shared())
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _compute(chunk: list[Scenario]) -> list[StudyRow]:
    study, shared = _STUDIES["study"]
    return [evaluate(study, scenario, shared) for scenario in chunk]


def _apart(study: Study, chunk: list[Scenario]) -> list[StudyRow]:
    """A chunk on a machine of the cluster, which keeps the geometry between chunks of one study."""
    if study.identity not in _STUDIES:
        _STUDIES.clear()
        _STUDIES[study.identity] = (study, Shared())
    return [evaluate(study, scenario, _STUDIES[study.identity][1]) for scenario in chunk]


def _on_cluster(
    study: Study, chunks: list[list[Scenario]], on_rows: Callable[[list[StudyRow]], None], address: str
) -> None:
    try:
        import distributed

        connect: Any = distributed.Client
        security: Any = distributed.Security
        as_completed: Any = distributed.as_completed
    except ImportError:
        raise InputError("--cluster: Dask is not installed; pip install 'compgen[cluster]', or leave it out") from None
    try:
        client: Any = connect(address, timeout=ANSWER, security=security())  # of Dask's own settings
    except TypeError:  # an encrypted address, and no certificates
        raise InputError(
            f"--cluster {address:.80}: Dask has no certificates for it; set distributed.comm.tls (ca-file, "
            "client.cert, client.key) in its settings"
        ) from None
    except (OSError, TimeoutError, ValueError) as failure:
        raise InputError(
            f"--cluster {address}: it does not answer within {ANSWER:.0f} s ({type(failure).__name__}); "
            "leave --cluster out to run on this machine's cores"
        ) from None
    with client:
        futures = client.map(lambda chunk: _apart(study, chunk), chunks, pure=False)
        for future in as_completed(futures):
            on_rows(future.result())
