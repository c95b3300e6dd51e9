"""A round of the benches: each topic in a process of its own, one line of summary a topic, the next run goes on with what
is missing."""

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from . import store

FRONT = Path(__file__).resolve().parent
FRESH = "--fresh"
PAGE = "page"  # writes what the others have measured: never kept


def report_of(topic: str) -> Path:
    return store.kept("reports") / f"{topic}.json"


@contextmanager
def reported(topic: str, words: list[str]) -> Iterator[None]:
    """What a topic has written and left out, with which options, or its error: in its report, when it ends."""
    report, began = {"words": [word for word in words if word != FRESH], "error": ""}, time.monotonic()
    try:
        yield
    except BaseException as error:
        report["error"] = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise
    finally:
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        report["wall_s"] = round(time.monotonic() - began, 1)
        report["cpu_s"] = round(sum(one.ru_utime + one.ru_stime for one in used), 1)
        report |= {"results": sorted(set(store.WROTE)), "left_out": store.LEFT_OUT, "commit": store.commit()}
        path = report_of(topic)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(report, indent=1) + "\n")


def measure_all(topics: dict[str, list[str]], build: Path, fresh: bool) -> int:
    """Topics with their options, one after the other; how many failed. One that fails is no hindrance to the others."""
    began, failed = time.monotonic(), []
    for number, (topic, options) in enumerate(topics.items(), 1):
        words = [*options, "--build-dir", str(build)]
        report = None if fresh or topic == PAGE else done(topic, words)
        was_kept = report is not None
        if not was_kept:
            report = measure(topic, [*words, *([FRESH] if fresh else [])])
        else:
            store.adopt(report["results"])
        failed += [topic] if report["error"] else []
        print(f"bench: {number:2} of {len(topics)}  {topic:<11} {line(report, was_kept)}", flush=True)
    minutes = (time.monotonic() - began) / 60
    print(f"bench: {len(topics) - len(failed)} of {len(topics)} topics in {minutes:.0f} minutes. {origins()}")
    if failed:
        print(f"bench: failed: {', '.join(failed)}; the same command goes on with them", file=sys.stderr)
    return len(failed)


def done(topic: str, words: list[str]) -> dict | None:
    """The report of a topic that has been measured in this state of the tree, with these options."""
    path = report_of(topic)
    report = json.loads(path.read_text()) if path.exists() else None
    return report if report and not report["error"] and report["words"] == words else None


def measure(topic: str, words: list[str]) -> dict:
    """Runs a topic; its progress is shown, the rest of what it says goes to a file beside its report."""
    report = report_of(topic)
    report.parent.mkdir(parents=True, exist_ok=True)
    report.unlink(missing_ok=True)
    with report.with_suffix(".txt").open("w") as output:
        ended = subprocess.run([sys.executable, FRONT, topic, *words], stdout=output, check=False)
    if report.exists():
        return json.loads(report.read_text())
    return {"error": f"ended with {ended.returncode}", "results": [], "left_out": {}, "wall_s": 0, "cpu_s": 0}


def line(report: dict, was_kept: bool) -> str:
    """One topic's summary: time, its results, what was left out and why."""
    time_ = "kept" if was_kept else f"{report['wall_s'] / 60:.1f} min, {report['cpu_s'] / 60:.1f} of processor"
    if report["error"]:
        return f"FAILED after {time_}: {report['error']}"
    left = [f"left out: {name} ({error})" for name, error in report["left_out"].items()]
    return "; ".join([time_, ", ".join(report["results"]), *left])


def origins() -> str:
    """Whether every figure of the pages is of one commit, and which are not."""
    of = json.loads((store.RESULTS / store.ORIGINS).read_text())
    now = store.commit()
    others = {store.COMMAND_OF_RESULT[name] for name, origin in of.items() if origin["commit"] != now}
    if not others:
        return f"Every figure is of commit {now}."
    return f"Figures of other commits than {now} are those of: {', '.join(sorted(others))}."
