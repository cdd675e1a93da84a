#!/usr/bin/env python3
"""Every script of the package lammps-examples that plain `lmp` runs is streamed, saved and loaded once, or refused by name.

    corpus_test.py --program TANDEM_LAMMPS --tandem TANDEM [--only TEXT]
"""

import argparse
import concurrent.futures
import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

EXAMPLES = pathlib.Path("/usr/share/lammps/examples")
LIMIT_S = 120
# What no engine can show, with the line that says so.
REFUSED = [
    r"has no run",  # it only makes something ready for others
    r"waits for a viewer of its own",
    r"did not connect within 10 s",  # it minimizes for longer, or waits for another program: --engine-socket
]

GOOD = ("streamed", "refused", "minimizes for longer than this test waits", "no script of plain lmp's")


def run(command, folder, limit_s):
    """(exit code, output); None: it was still running after that time."""
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen(
            list(map(str, command)), cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
        )
        try:
            code = child.wait(limit_s)
        except subprocess.TimeoutExpired:
            code = None
            os.killpg(child.pid, 9)
            child.wait()
        log.seek(0)
        return code, log.read().decode(errors="replace")


def outcome(script):
    """One of GOOD, or what is wrong."""
    with tempfile.TemporaryDirectory() as parent:
        folder = pathlib.Path(parent) / "copy"
        shutil.copytree(script.parent, folder, ignore_dangling_symlinks=True)
        for packed in folder.rglob("*.gz"):
            packed.with_suffix("").write_bytes(gzip.decompress(packed.read_bytes()))
        name = script.name.removesuffix(".gz")
        check = [OPTIONS.tandem, "engine-check", "--frames", 2, "--", OPTIONS.program, "--every", 1, name]
        code, text = run(check, folder, LIMIT_S)
        if code == 0 and ("frames after LOAD" in text or "no checkpoints are kept" in text):
            return "streamed"
        if any(re.search(line, text) for line in REFUSED):
            return "refused"
        if code is None and "minimization" in text[text.rfind("Setting up") :].split("\n")[0]:
            return "minimizes for longer than this test waits"
        plain, _ = run(["lmp", "-in", name, "-log", "none"], folder, 10)
        if plain not in (0, None):
            return "no script of plain lmp's"
        lines = [line for line in text.splitlines() if re.search(r"ERROR|tandem-lammps:|^wrong:|^note:", line)]
        return " | ".join(lines[:3]) or f"exit code {code}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--program")
    parser.add_argument("--tandem", required=True)
    parser.add_argument("--only", default="", help="scripts whose path has this text")
    OPTIONS = parser.parse_args()
    if not OPTIONS.program or not shutil.which("lmp") or not EXAMPLES.exists():
        print("skipped: LAMMPS or lammps-examples is missing (deploy/install-packages lammps simulations)")
        sys.exit(77)
    scripts = sorted(path for path in EXAMPLES.rglob("in.*") if path.is_file() and OPTIONS.only in str(path))
    counts, wrong = {}, 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for script, result in zip(scripts, pool.map(outcome, scripts)):
            counts[result] = counts.get(result, 0) + 1
            wrong += result not in GOOD
            if result not in ("streamed", "no script of plain lmp's"):
                print(f"{script.relative_to(EXAMPLES)}: {result}", flush=True)
    print(", ".join(f"{counts[key]} {key}" for key in GOOD if key in counts))
    sys.exit(1 if wrong or "streamed" not in counts else 0)
