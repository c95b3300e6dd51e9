"""Many independent jobs over several processes, resumable: one JSON file per job, and the same bytes for any workers.

A job is a name and a dict of keyword arguments for `work`, a function at the top level of a module that returns what
JSON can hold.
"""

import json
import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from crunchbot.outputs import put


def sweep(
    work: Callable[..., dict],
    jobs: dict[str, dict],
    folder: Path,
    workers: int | None = None,
    label: str = "sweep",
) -> dict[str, dict]:
    """Results by job name, in the order of `jobs`; jobs whose file is in `folder` are not done again.

    `workers`: processes, all cores by default. Stopped at any moment, it goes on where it was.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    todo = {name: arguments for name, arguments in jobs.items() if not _path(folder, name).exists()}
    with tqdm(total=len(jobs), initial=len(jobs) - len(todo), desc=label, unit="job") as bar:
        for name, result in _in_processes(work, todo, workers or os.cpu_count() or 1) if todo else ():
            _keep(_path(folder, name), result)
            bar.update()
    return {name: json.loads(_path(folder, name).read_text()) for name in jobs}


def _path(folder: Path, name: str) -> Path:
    return folder / f"{name}.json"


def _keep(path: Path, result: dict) -> None:
    """Whole or not at all."""
    put(path, json.dumps(result, sort_keys=True) + "\n", sync=False)


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
