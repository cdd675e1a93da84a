#!/usr/bin/env python3
"""What --metrics costs tandemd: half_pipe with 10,000 bodies, with and without, in turns.

cost.py --tandemd PATH [--seconds 30] [--rounds 3] [--bodies 10000] [--every 1.0]

Prints a line for each run and the differences. The thread `metrics` is told apart from the rest of the process.
"""

import argparse
import os
import pathlib
import re
import statistics
import subprocess
import tempfile
import time
import urllib.request

LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>metrics-cost-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)


def cpu_s(pid):
    """Processor time by thread name."""
    used = {}
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        name = (task / "comm").read_text().strip()
        used[name] = used.get(name, 0) + int((task / "schedstat").read_text().split()[0]) / 1e9
    return used


def resident_kb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text()).group(1))


def run(options, metrics):
    """Shares of a core in percent, KB, and milliseconds of scrapes."""
    command = [options.tandemd, "--scene", "half_pipe", "--bodies", options.bodies, "--scripted", "--session", "cost"]
    with tempfile.TemporaryFile() as log:
        server = subprocess.Popen(
            [*map(str, command), *(("--metrics", "0") if metrics else ())],
            stdout=subprocess.DEVNULL, stderr=log, env={**os.environ, "CYCLONEDDS_URI": LOOPBACK},
        )  # fmt: skip
        try:
            time.sleep(8)  # the first bodies have landed
            log.seek(0)
            place = re.search(rb"(http://\S+)/metrics", log.read())
            url = place.group(1).decode() + "/metrics" if place else None
            before, began = cpu_s(server.pid), time.monotonic()
            took_ms, size = [], 0
            for turn in range(1, int(options.seconds / options.every) + 1):
                time.sleep(max(began + turn * options.every - time.monotonic(), 0))
                if url:
                    start = time.perf_counter()
                    with urllib.request.urlopen(url, timeout=5) as answer:
                        size = len(answer.read())
                    took_ms.append((time.perf_counter() - start) * 1e3)
            after, elapsed = cpu_s(server.pid), time.monotonic() - began
            share = {name: (after[name] - before.get(name, 0)) / elapsed * 100 for name in after}
            return {"all": sum(share.values()), "thread": share.get("metrics", 0), "kb": resident_kb(server.pid),
                    "scrapes_ms": sorted(took_ms), "page_bytes": size}  # fmt: skip
        finally:
            server.terminate()
            server.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", required=True)
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--bodies", type=int, default=10000)
    parser.add_argument("--every", type=float, default=1.0, help="seconds between scrapes")
    options = parser.parse_args()
    runs = {False: [], True: []}
    for _ in range(options.rounds):
        for metrics in (False, True):
            result = run(options, metrics)
            runs[metrics].append(result)
            took = result["scrapes_ms"]
            scrapes = f", scrapes p50 {statistics.median(took):.2f} max {took[-1]:.2f} ms, {result['page_bytes']} bytes" if took else ""
            print(f"metrics {'on ' if metrics else 'off'}: {result['all']:.2f} % of a core, the thread {result['thread']:.3f} %, "
                  f"{result['kb']} KB{scrapes}", flush=True)  # fmt: skip
    for what, unit in (("all", "% of a core"), ("kb", "KB")):
        on, off = (statistics.median(run_[what] for run_ in runs[metrics]) for metrics in (True, False))
        print(f"on - off, medians: {on - off:+.2f} {unit}")


if __name__ == "__main__":
    main()
