"""Runs many independent jobs: here, in processes, or on the machines of a Ray cluster.

A job carries its seed, so that neither the number of workers nor the machine decides a result.
"""

import importlib.util
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_context
from typing import Any, TypeVar

from schemas.errors import MissingComponentError, UserError

J = TypeVar("J")
R = TypeVar("R")

LOCAL = ""
"""Address of a cluster that is started here and ends with the experiment."""
_one_thread = {"OPENBLAS_NUM_THREADS": "1"}
"""Several threads for matrices this small only cost time."""


def finished(
    run: Callable[[J], R], jobs: Sequence[J], workers: int, cluster: str | None = None
) -> Iterator[tuple[int, R]]:
    """Number and result of each job, as they are done.

    Args:
        run: a function of a module, which every worker imports.
        jobs: what to run.
        workers: processes that may work at once on this machine.
        cluster: address of a Ray cluster, `LOCAL`, or None to use no cluster.
    """
    if cluster is not None:
        yield from _on_cluster(run, jobs, workers, cluster)
    elif workers == 1:
        yield from ((number, run(job)) for number, job in enumerate(jobs))
    else:
        yield from _in_processes(run, jobs, workers)


def require_ray() -> None:
    """Check that the optional extra is there.

    Raises:
        MissingComponentError: it is not.
    """
    if importlib.util.find_spec("ray") is None:
        raise MissingComponentError(
            "a cluster needs Ray, which is not installed: .venv/bin/pip install 'ray>=2.50' here "
            "and on every machine of the cluster, or leave --cluster out"
        )


def _in_processes(
    run: Callable[[J], R], jobs: Sequence[J], workers: int
) -> Iterator[tuple[int, R]]:
    for name, value in _one_thread.items():
        os.environ.setdefault(name, value)  # workers inherit it
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        numbers = {pool.submit(run, job): number for number, job in enumerate(jobs)}
        for done in as_completed(numbers):
            yield numbers[done], done.result()


def _on_cluster(
    run: Callable[[J], R], jobs: Sequence[J], workers: int, address: str
) -> Iterator[tuple[int, R]]:
    require_ray()
    ray: Any = import_module("ray")
    _join(ray, workers, address)
    try:
        remote = ray.remote(num_cpus=1)(run)
        numbers = {remote.remote(job): number for number, job in enumerate(jobs)}
        while numbers:
            (done, *_), _ = ray.wait(list(numbers))
            yield numbers.pop(done), ray.get(done)
    finally:
        ray.shutdown()


def _join(ray: Any, workers: int, address: str) -> None:
    # Workers import the packages from where they are installed: nothing is uploaded.
    settings: dict[str, Any] = {
        "runtime_env": {"env_vars": _one_thread},
        "log_to_driver": False,
        "logging_level": "ERROR",
    }
    if address == LOCAL:
        ray.init(num_cpus=workers, include_dashboard=False, **settings)
        return
    try:
        ray.init(address=address, **settings)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise UserError(
            f"no Ray cluster answers at {address!r}; allowed: 'auto' on a machine of a running "
            f"cluster, HOST:PORT, ray://HOST:PORT, or no address to start one here ({error})"
        ) from error
