#!/usr/bin/env python3
"""What DDS Security costs: publish time, joins and frames of 8 clients and 10,000 bodies, without and with it in turn.

bench_secure.py --tandemd PATH --tandem PATH [--runs N] [--clients N] [--bodies N] [--seconds N]

Clients come two seconds apart, so that each joins a session that runs. Prints the median of the runs, and asserts nothing.
"""

import argparse
import json
import os
import pathlib
import socket
import statistics
import subprocess
import tempfile
import time
import urllib.request

URI = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "</General></Domain></CycloneDDS>"
)
DOMAIN = 87
SEED = 1


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def published(port):
    """Sum in seconds, count, of the time that DDS took for a frame."""
    page = urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10).read().decode()
    value = lambda name: float(next(line.split()[-1] for line in page.splitlines() if line.startswith(name)))  # noqa: E731
    return value("tandem_publish_duration_seconds_sum"), value("tandem_publish_duration_seconds_count")


def measure(options, folder, secure):
    environment = {**os.environ, "CYCLONEDDS_URI": URI}
    identity = lambda name: ["--secure", f"{folder}/pki/{name}"] if secure else []  # noqa: E731
    port = free_port()
    running = []

    def start(*words):
        running.append(subprocess.Popen([str(word) for word in words], env=environment, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True))  # fmt: skip
        return running[-1]

    try:
        server = start(options.tandemd, "--scene", "half_pipe", "--bodies", options.bodies, "--seed", SEED, "--scripted",
                       "--domain", DOMAIN, "--metrics", port, "--json", *identity("server"))  # fmt: skip
        time.sleep(3)
        clients = []
        for _ in range(options.clients):
            clients.append(start(options.tandem, "join", "--json", "--domain", DOMAIN, *identity("client")))
            time.sleep(2)
        began = published(port)
        time.sleep(options.seconds)
        ended = published(port)
        reports = []
        for client in clients:
            client.send_signal(2)
            reports.append(json.loads(client.communicate(timeout=30)[0]))
        server.send_signal(2)
        totals = json.loads(server.communicate(timeout=30)[0])
    finally:
        for each in running:
            if each.poll() is None:
                each.kill()
            each.wait()
    return {
        "publish_ms": 1e3 * (ended[0] - began[0]) / max(1, ended[1] - began[1]),
        "frames_per_s": (ended[1] - began[1]) / options.seconds,
        "join_ms": statistics.median(report["join_ms"] + report["discovery_ms"] for report in reports),
        "latency_ms_p99": statistics.median(report["latency_ms"]["p99"] for report in reports),
        "rejoins": sum(report["resyncs"] for report in reports),
        "mismatches": sum(report["hash_mismatches"] for report in reports),
        "stalls": totals["stalls"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tandemd", type=pathlib.Path, required=True)
    parser.add_argument("--tandem", type=pathlib.Path, required=True)
    for name, usual in (("runs", 3), ("clients", 8), ("bodies", 10_000), ("seconds", 20)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for words in (["init"], ["issue", "server", "server"], ["issue", "participant", "client"]):
            subprocess.run([options.tandem, "pki", *words, "--dir", f"{folder}/pki"], check=True, capture_output=True)
        runs = {False: [], True: []}
        for _ in range(options.runs):
            for secure in runs:
                runs[secure].append(measure(options, folder, secure))
    print(f"{options.clients} clients, {options.bodies} bodies, {options.seconds} s, medians of {options.runs} runs, "
          f"seed {SEED}")  # fmt: skip
    print(f"{'':<16}{'without':>12}{'with':>12}{'factor':>9}")
    for name in runs[True][0]:
        plain, secure = (statistics.median(run[name] for run in runs[each]) for each in (False, True))
        print(f"{name:<16}{plain:>12.3f}{secure:>12.3f}" + (f"{secure / plain:>9.2f}" if plain else ""))


if __name__ == "__main__":
    main()
