"""Many independent jobs over several processes, resumable: one JSON file per job, and the same bytes for any workers.

A job is a name and a dict of keyword arguments for `work`, a function at the top level of a module that returns what
JSON can hold. Processes of this machine by default; Dask, if it is installed, spreads the same jobs over a cluster.
"""

import json
import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from crunchbot.errors import UserError

BACKENDS = ("processes", "serial", "dask")


class SweepError(UserError):
    """A backend that is not there, or a job that failed; one line."""

    exit_code = 1


def sweep(
    work: Callable[..., dict],
    jobs: dict[str, dict],
    folder: Path,
    workers: int | None = None,
    backend: str = "processes",
    label: str = "sweep",
) -> dict[str, dict]:
    """Results by job name, in the order of `jobs`; jobs whose file is in `folder` are not done again.

    `workers`: processes, all cores by default. Stopped at any moment, it goes on where it was.
    """
    if backend not in BACKENDS:
        raise SweepError(f"backend '{backend}' is unknown; choose one of {', '.join(BACKENDS)}")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    todo = {name: arguments for name, arguments in jobs.items() if not _path(folder, name).exists()}
    run = {"processes": _in_processes, "serial": _in_turn, "dask": _by_dask}[backend]
    with tqdm(total=len(jobs), initial=len(jobs) - len(todo), desc=label, unit="job") as bar:
        for name, result in run(work, todo, workers or os.cpu_count() or 1) if todo else ():
            _keep(_path(folder, name), result)
            bar.update()
    return {name: json.loads(_path(folder, name).read_text()) for name in jobs}


def _path(folder: Path, name: str) -> Path:
    return folder / f"{name}.json"


def _keep(path: Path, result: dict) -> None:
    """Whole or not at all."""
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_text(json.dumps(result, sort_keys=True) + "\n")
    fresh.replace(path)


def _in_turn(work, jobs: dict[str, dict], workers: int) -> Iterator[tuple[str, dict]]:
    for name, arguments in jobs.items():
        yield name, work(**arguments)


def _in_processes(work, jobs: dict[str, dict], workers: int) -> Iterator[tuple[str, dict]]:
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        names = {pool.submit(work, **arguments): name for name, arguments in jobs.items()}
        yield from _gathered(names, as_completed(names), pool)


def _gathered(names: dict, done, pool: ProcessPoolExecutor) -> Iterator[tuple[str, dict]]:
    try:
        for future in done:
            yield names[future], future.result()
    except BaseException:  # a failed job or Ctrl-C: what waits is not begun
        pool.shutdown(wait=False, cancel_futures=True)
        raise


def _by_dask(work, jobs: dict[str, dict], workers: int) -> Iterator[tuple[str, dict]]:
    try:
        from dask import distributed
    except ImportError as error:
        raise SweepError("backend 'dask': not installed; pip install 'dask[distributed]', or use processes") from error
    address = os.environ.get("DASK_SCHEDULER_ADDRESS")
    options = (
        {"address": address} if address else {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None}
    )
    with distributed.Client(**options) as client:
        names = {client.submit(work, **arguments, pure=False): name for name, arguments in jobs.items()}
        for future in distributed.as_completed(names):
            yield names[future], future.result()
