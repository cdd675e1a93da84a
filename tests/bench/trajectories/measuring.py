"""Runs programs, measures recordings with `tandem bench bandwidth --trajectory`, and writes tables; Python alone."""

import json
import subprocess
import sys

TIMEOUT_S = 480


def run(command, **more):
    """The output of a command; ends the program if it fails."""
    try:
        done = subprocess.run([str(part) for part in command], timeout=TIMEOUT_S, capture_output=True, check=False, **more)
    except (OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"generate: {command[0]}: {error}")
    if done.returncode:
        output = (done.stdout[-1000:] if len(done.stdout) < 10000 else b"") + done.stderr[-1000:]
        sys.exit(f"generate: {command[0]} failed with {done.returncode}:\n{output.decode(errors='replace')}")
    return done.stdout


def measure(tool, npy, codecs, predictor, *more):
    """Rows by codec, with `bytes` a frame."""
    command = [tool, "bench", "bandwidth", "--trajectory", npy, "--codec", codecs, "--predictor", predictor, "--json", *more]
    rows = json.loads(run(command))["rows"]
    for row in rows:
        if not row["missing"]:
            row["bytes"] = row["mbit_per_s"] * 2**20 / 8 * row["dt_s"]
    return {row["codec"]: row for row in rows}


def table(header, lines):
    head = "| " + " | ".join(header) + " |\n|" + "---|" * len(header)
    return "\n".join([head, *("| " + " | ".join(line) + " |" for line in lines)]) + "\n"


def peer_cells(rows, ours):
    """Names of the peers among `rows`, what they take, and how often the best of them takes what `ours` does."""
    peers = [codec for codec, row in rows.items() if not row["predictor"]]
    there = [rows[peer]["bytes"] for peer in peers if not rows[peer]["missing"]]
    cells = [f"needs {rows[p]['missing']}" if rows[p]["missing"] else f"{rows[p]['bytes']:.0f}" for p in peers]
    return peers, [*cells, f"{min(there) / ours:.1f}" if there else "-"]
