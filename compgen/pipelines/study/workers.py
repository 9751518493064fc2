"""Scenarios over all cores of this machine, or over a Dask cluster: the same rows, whoever computes them."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import resource_tracker
from queue import SimpleQueue
from typing import Any

from compgen.core import interrupts
from compgen.core.exceptions import InputError
from compgen.pipelines.study.evaluate import Row, Shared, evaluate, geometry_key
from compgen.pipelines.study.scenarios import Scenario, Study

CHUNK = 20  # scenarios of one geometry that go to a worker together
ANSWER = 10.0  # [s] that a cluster has to answer


def run(
    study: Study,
    done: set[int],
    on_rows: Callable[[list[Row]], None],
    workers: int = 0,
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
    groups: dict[tuple[tuple[str, str], ...], list[Scenario]] = {}
    for scenario in todo:
        groups.setdefault(geometry_key(scenario), []).append(scenario)
    for group in groups.values():
        for k in range(0, len(group), CHUNK):
            yield group[k : k + CHUNK]


def _on_cores(study: Study, chunks: list[list[Scenario]], on_rows: Callable[[list[Row]], None], workers: int) -> None:
    """Chunks over processes; this thread waits where Ctrl-C can interrupt it without leaving a lock of the pool taken.

    An interrupt in the pool's own waiting may come between taking a lock and noting that it was taken: the pool then
    never ends. So the pool's thread hands over what is done, and this one only takes it from a queue.
    """
    context = multiprocessing.get_context("spawn")
    results: SimpleQueue[tuple[list[Row], BaseException | None]] = SimpleQueue()

    def hand_over(future: Future[list[Row]]) -> None:
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


def _compute(chunk: list[Scenario]) -> list[Row]:
    study, shared = _STUDIES["study"]
    return [evaluate(study, scenario, shared) for scenario in chunk]


def _apart(study: Study, chunk: list[Scenario]) -> list[Row]:
    """A chunk on a machine of the cluster, which keeps the geometry between chunks of one study."""
    if study.identity not in _STUDIES:
        _STUDIES.clear()
        _STUDIES[study.identity] = (study, Shared())
    return [evaluate(study, scenario, _STUDIES[study.identity][1]) for scenario in chunk]


def _on_cluster(study: Study, chunks: list[list[Scenario]], on_rows: Callable[[list[Row]], None], address: str) -> None:
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
