"""Soak: the programs as they are, for long, under what must not harm them. Prints one table.

python3 tests/fault/soak --case NAME [--case NAME ...] | --case all   [--minutes M] [--seed N] [--resume FILE]

In network namespaces of its own, for which `ip` and the right to make one are needed. Each case is bounded in time, and ends
all that it started. With --resume the results are kept in a file: a case that has ended is not run again. A case that failed or was
interrupted is run anew, because memory and clients cannot be picked up where they were. The last column of the table says
how long a case ran and what share of the processors other programs used meanwhile, so that short runs and busy machines are
seen for what they are.

Exit 0: every wanted value was reached. 1: something was missed, or a case failed. 2: wrong usage. 77: not run, because
namespaces are not allowed here.
"""

import argparse
import dataclasses
import json
import os
import pathlib
import random
import signal
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import crowds  # noqa: E402
import restarts  # noqa: E402
import standbys  # noqa: E402
from clients import SoakStage  # noqa: E402
from stage import NOT_RUN, Failed, enter_namespace, shell  # noqa: E402
from watching import Machine  # noqa: E402

MARGIN_S = 420  # of a case, for its beginning and its end


@dataclasses.dataclass
class Case:
    run: object  # (stage, minutes, random numbers) -> rows of (case, wanted, measured, reached)
    minutes: float  # in full length


CASES = {
    "checkpoint": Case(restarts.checkpoint, 3),
    "killed": Case(restarts.killed, 5),
    "takeover": Case(standbys.takeover, 5),
    "handover": Case(standbys.handover, 5),
    "rate": Case(standbys.rate, 3),
    "power": Case(restarts.power, 0.1),
    "crowd": Case(crowds.crowd, 10),
    "largest": Case(crowds.largest, 8),
    "hour": Case(crowds.hour, 60),
}
PROGRAMS = {
    "tandemd": "bin/tandemd",
    "tandem": "bin/tandem",
    "gateway": "bin/tandem-gateway",
    "viewers": "tests/fault/soak/viewers",
    "test_checkpoint": "tests/unit/checkpoint/test_checkpoint",
}


def parser():
    made = argparse.ArgumentParser(prog="soak", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--case", action="append", metavar="NAME", help=f"all, or: {', '.join(CASES)}")
    made.add_argument("--minutes", type=float, help="of each case; by default " + ", ".join(
        f"{name} {case.minutes:g}" for name, case in CASES.items()))  # fmt: skip
    made.add_argument("--seed", type=int, default=1, help="of the server, and of what happens when (default: 1)")
    made.add_argument("--resume", type=pathlib.Path, metavar="FILE", help="results so far; made if it does not exist")
    made.add_argument("--build", type=pathlib.Path, default=HERE.parents[2] / "build/release",
                      help="folder of the build (default: build/release)")  # fmt: skip
    made.add_argument("--only-measure", action="store_true", help="exit with 1 only if a case fails")
    made.add_argument("--list", action="store_true", help="the names of all cases")
    return made


def chosen_cases(options, made):
    names = [name for word in options.case or [] for name in (CASES if word == "all" else word.split(","))]
    if not names:
        made.error("--case is missing; --list says which there are")
    if unknown := [name for name in names if name not in CASES]:
        made.error(f"no case {unknown[0]}; --list says which there are")
    if options.minutes is not None and not 0 < options.minutes <= 24 * 60:
        made.error("--minutes is not in 0 to 1440")
    return list(dict.fromkeys(names))


def read_results(path, made):
    """Return the results of the cases that did not fail, by the case's name."""
    if path is None or not path.exists():
        return {}
    try:
        results = json.loads(path.read_text())
        return {name: result for name, result in results.items() if result["rows"] and not result["failed"]}
    except (ValueError, KeyError, TypeError, AttributeError, OSError) as error:
        made.error(f"{path} holds no results: {error}")


def keep_results(path, results):
    if path is None:
        return
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps(results, indent=1) + "\n")
    part.replace(path)


def late(*_):
    raise Failed("it did not end in its time")


def run_case(name, options):
    """Run a case in a network of its own. Return its result."""
    case = CASES[name]
    minutes = case.minutes if options.minutes is None else options.minutes
    stage, machine, began = SoakStage(options), Machine(), time.monotonic()
    signal.signal(signal.SIGALRM, late)
    signal.alarm(int(minutes * 60 * 1.5) + MARGIN_S)
    failed = False
    try:
        rows = case.run(stage, minutes, random.Random(options.seed))
    except (Failed, OSError, KeyError) as failure:
        failed = True
        rows = [(name, "ends", f"FAILED: {failure!r}", False)]
    finally:
        signal.alarm(0)
        stage.end()
    return {"rows": rows, "failed": failed, "minutes": round((time.monotonic() - began) / 60, 1), "seed": options.seed,
            "others_percent": round(machine.others_percent()), "cores": os.cpu_count()}  # fmt: skip


def table(results):
    lines = ["| case | wanted | measured | reached | how long it ran here |", "|---|---|---|---|---|"]
    for result in results.values():
        ran = f"{result['minutes']:g} min, seed {result['seed']}; others used {result['others_percent']} % of {result['cores']} cores"
        for what, wanted, measured, reached in result["rows"]:
            lines.append(f"| {what} | {wanted} | {measured} | {'yes' if reached else 'NO'} | {ran} |")
    return "\n".join(lines)


def verdict(results, only_measure):
    """Return the exit code."""
    if only_measure:
        return 1 if any(result["failed"] for result in results) else 0
    return 0 if all(row[3] for result in results for row in result["rows"]) else 1


def run(names, options, made):
    results = read_results(options.resume, made)
    for name in names:
        if name in results:
            print(f"{name}: ended before ({options.resume})", flush=True)
            continue
        print(f"{name}: seed {options.seed}", flush=True)
        results[name] = run_case(name, options)
        keep_results(options.resume, results)
    shown = {name: results[name] for name in names}
    print(table(shown))
    return verdict(shown.values(), options.only_measure)


def main():
    made = parser()
    options = made.parse_args()
    if options.list:
        print("\n".join(CASES))
        return 0
    names = chosen_cases(options, made)
    for name, path in PROGRAMS.items():
        setattr(options, name, options.build.resolve() / path)
        if not getattr(options, name).exists():
            made.error(f"{getattr(options, name)} is missing: build it, or name another folder with --build")
    if not enter_namespace():
        print("not run: network namespaces or tc are not allowed here")
        return NOT_RUN
    shell("tc", "qdisc", "del", "dev", "lo", "root")  # loopback as fast as it is
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        return run(names, options, made)
    except KeyboardInterrupt:
        print("interrupted; --resume keeps what had ended", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
