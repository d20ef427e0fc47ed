"""The fuzz campaign of docs/robustness.md: random valid scenes, run in a process that can be killed.

    python tools/fuzz.py --scenes 10000 --seed 1

Every run must end correctly or with a named failure: without values that are not finite, crashes or hangs, and without a
success that contradicts the energy balance, the friction disc or a second method (fuzz_second.py). The exit code is 1
otherwise, or if at least a thousandth of the sensible scenes fails. --output writes the table to a JSON file.
"""

from __future__ import annotations

import json
import selectors
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fuzz_combined import COMBINED
from fuzz_scenes import SHORT, SPECS
from rich.progress import track

from msfp_gen import Effects, Layout, build_model

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import parser, pick

HERE = Path(__file__).parent
LIMIT = 120.0  # wall time of one scene [s]; a hundred times that of most scenes, ten times that of the slowest
SAVED = 100  # scenes between two writes of the table
ALLOWED = 1e-3  # largest share of sensible scenes that fail
Row = dict[str, Any]


class Worker:
    """A process that runs scenes by their number. It is killed if it hangs, and restarted after that or a crash."""

    def __init__(self, seed: int, limit: float, which: str = "all") -> None:
        self.seed, self.limit, self.which = seed, limit, which
        self.process: subprocess.Popen[str] | None = None

    def ask(self, task: str, number: int) -> Row:
        """Result of `task` ("run" or "check") for one scene; its status is "hang" or "crash" if the process failed."""
        if self.process is None:
            command = [sys.executable, str(HERE / "fuzz_worker.py"), str(self.seed), self.which]
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(f"{task} {number}\n")
        self.process.stdin.flush()
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            if not selector.select(self.limit):
                self.stop()
                return {"number": number, "status": "hang", "message": f"no answer in {self.limit:g} s"}
        line = self.process.stdout.readline()
        if line:
            row: Row = json.loads(line)
            return row
        code = self.ended()
        reason = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return {"number": number, "status": "crash", "message": reason}

    def ended(self) -> int:
        """Wait for the end of the process; returns its exit code."""
        assert self.process is not None
        process, self.process = self.process, None
        with process:
            return process.wait()

    def stop(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.ended()


def build_all(specs: list[Any]) -> None:
    """Build all models, so that the time limit of a scene does not include builds."""
    for layout, words in track(specs, "building models", disable=not sys.stderr.isatty()):
        build_model(Layout(*layout), Effects(**words))


def campaign(worker: Worker, scenes: int, comparisons: int) -> Iterator[tuple[Row, Row | None]]:
    """Run `scenes` scenes, and compare about `comparisons` successes with the second method, evenly distributed."""
    compared = done = number = 0
    while done < scenes:
        row, found = worker.ask("run", number), None
        if row["status"] != "passed over":
            done += 1
            if row["status"] == "ok" and row["checkable"] and compared < comparisons * done / scenes:
                found = worker.ask("check", number)
                compared += "agrees" in found
            yield row, found
        number += 1


def faults(rows: list[Row], checks: list[Row]) -> list[str]:
    """Everything that must not happen, one line each."""
    out = [
        f"{r['number']}: {r['status']}: {r['message']}"
        for r in rows
        if r["status"] in ("hang", "crash", "refused") or r["status"].startswith("unnamed")
    ]
    out += [f"{r['number']}: not finite: {', '.join(r['not_finite'])}" for r in rows if r.get("not_finite")]
    out += [f"{r['number']}: success with {', '.join(r['wrong'])}" for r in rows if r.get("wrong")]
    out += [
        f"{c['number']}: success contradicted by the second method: {c}" for c in checks if not c.get("agrees", True)
    ]
    return out


def table(rows: list[Row], checks: list[Row]) -> Row:
    """The results of the campaign as counts."""
    sensible = [r for r in rows if r.get("sensible")]
    failed = [r for r in sensible if r["status"] not in ("ok", "stopped")]
    counts: Counter[str] = Counter()
    used: Counter[str] = Counter()
    for row in rows:
        counts.update(row.get("counts", {}))
        used.update(name for name, value in row.get("counts", {}).items() if value)
    compared = [c for c in checks if "agrees" in c]
    return {
        "scenes": len(rows),
        "models": len({r["spec"] for r in rows if "spec" in r}),
        "ends": dict(Counter(r["status"] for r in rows).most_common()),
        "sensible": len(sensible),
        "sensible_ends": dict(Counter(r["status"] for r in sensible).most_common()),
        "sensible_failures": [f"{r['number']} {r['spec']}: {r['message']}" for r in failed],
        "faults": faults(rows, checks),
        "noted": sum(r["status"] == "ok" and r.get("noted", False) for r in rows),
        "sensible_noted": sum(r["status"] == "ok" and r.get("noted", False) for r in sensible),
        "longest": round(max(r.get("wall", 0.0) for r in rows), 1),
        "checked": len(compared),
        "no_verdict": len(checks) - len(compared),
        "largest_deviation": max((c["deviation"] for c in compared), default=None),
        "verdicts": dict(Counter(r["verdict"] for r in rows if "verdict" in r).most_common()),
        "largest_unbalanced": max((r["unbalanced"] for r in rows if "unbalanced" in r), default=None),
        "counts": dict(counts),
        "scenes_with": dict(used),
    }


def commit() -> str:
    """The commit of this checkout."""
    done = subprocess.run(["git", "-C", str(HERE), "describe", "--always", "--dirty"], capture_output=True, text=True)
    return done.stdout.strip()


def save(found: Row, path: Path | None) -> None:
    """Write the table so far, so that a campaign that is stopped leaves its results."""
    if path is not None:
        path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def main(words: list[str] | None = None) -> int:
    """Run the campaign and print its table; returns the exit code."""
    options = parser(__doc__)
    options.add_argument("--scenes", type=int, default=pick(10_000, 20))
    options.add_argument("--seed", type=int, default=1)
    options.add_argument(
        "--check", type=int, default=pick(500, 2), help="number of successes to compare with the second method"
    )
    options.add_argument("--limit", type=float, default=LIMIT, help="wall time of one scene [s]")
    options.add_argument("--output", type=Path, help="JSON file for the table")
    group = options.add_mutually_exclusive_group()
    group.add_argument("--short", dest="which", action="store_const", const="short", help="only a few of the models")
    group.add_argument(
        "--combined",
        dest="which",
        action="store_const",
        const="combined",
        help="combinations of public constructors, each run checked row by row and with half its longest step",
    )
    group.add_argument("--sensible", dest="which", action="store_const", const="sensible", help="only sensible scenes")
    given = options.parse_args(words)
    which = given.which or pick("all", "short")
    build_all({"short": SHORT, "combined": COMBINED}.get(which, SPECS))
    begin, worker = time.perf_counter(), Worker(given.seed, given.limit, which)
    rows: list[Row] = []
    checks: list[Row] = []
    found: Row = {}
    tasks = campaign(worker, given.scenes, given.check)
    try:
        for row, check in track(tasks, "running", given.scenes, disable=not sys.stderr.isatty()):
            rows.append(row)
            checks += [check] if check is not None else []
            if len(rows) % SAVED == 0 or len(rows) == given.scenes:
                wall = round(time.perf_counter() - begin)
                found = {"seed": given.seed, "which": which, "commit": commit(), "wall": wall, **table(rows, checks)}
                save(found, given.output)
    finally:
        worker.stop()
    print(json.dumps(found, indent=1))
    failures = found["sensible"] - sum(found["sensible_ends"].get(end, 0) for end in ("ok", "stopped"))
    return int(bool(found["faults"]) or failures >= ALLOWED * max(found["sensible"], 1) > 0)


if __name__ == "__main__":
    sys.exit(main())
