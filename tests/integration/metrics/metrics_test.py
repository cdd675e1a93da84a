#!/usr/bin/env python3
"""A live session, a gateway and a recorder, scraped by Debian's Prometheus on loopback; deploy/metrics is checked on the way.

metrics_test.py rules|session|deployed|faults|links|silence|strangers --tandemd PATH --tandem PATH --gateway PATH --wrong-hashes PATH
    [--minutes N]

Exit 0 passed, 1 failed, 77 not run.
"""

import argparse
import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

import alerts
import faults
import links
import silence
from programs import DEPLOYED, ENVIRONMENT, LIMIT_S, RULES, Halting, Prometheus, Stage, checked, get, values, wait_for

NOT_RUN = 77
SERIES = re.compile(r"\b(?:(?:tandem|process)_\w+|instance\w*:[\w:]+|up\b)(?:\{[^}]*\})?")


def dashboard_queries():
    """The queries as Grafana sends them with everything chosen."""
    dashboard = json.loads((DEPLOYED / "tandem.dashboard.json").read_text("utf-8"))
    queries = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    queries += [annotation["expr"] for annotation in dashboard["annotations"]["list"]]
    for variable in dashboard["templating"]["list"]:
        if variable["type"] == "query":
            queries.append(re.fullmatch(r"label_values\((.*), \w+\)", variable["query"]).group(1))
    replaced = (("$__rate_interval", "30s"), ("$job", ".*"), ("$instance", ".*"))
    for name, value in replaced:
        queries = [query.replace(name, value) for query in queries]
    assert not [query for query in queries if "$" in query], queries
    return queries


def rule_queries(prometheus):
    return [rule["query"] for group in prometheus.ask("rules")["groups"] for rule in group["rules"]]


def check_queries(prometheus):
    """Each series that a query names is there, with the labels that it names, and each query can be computed."""
    rules, shown = rule_queries(prometheus), dashboard_queries()
    written = sum(len(re.findall(r"- (?:alert|record): ", (DEPLOYED / name).read_text("utf-8"))) for name in RULES)
    assert len(rules) == written and len(shown) >= 40, (len(rules), written, len(shown))
    selectors = {selector for query in rules + shown for selector in SERIES.findall(query)}
    # Only a server that stands by has these, at which `faults` looks, and a relay, at which its own test does.
    elsewhere = re.compile("tandem_(standby|relay)_")
    selectors = {selector for selector in selectors if not elsewhere.search(selector)}
    shown = [query for query in shown if not elsewhere.search(query)]
    missing = [each for each in selectors if not prometheus.query(each)]
    assert not missing, f"no such series: {missing}"
    filled = [query for query in shown if "> 0" not in query and "ALERTS" not in query]
    wait_for(lambda: all(prometheus.query(query) for query in filled), f"something in each panel of {filled}")  # rates need two scrapes
    print(f"{len(rules)} rules and {len(shown)} queries of the dashboard name {len(selectors)} selectors that are there", flush=True)


def check_page(job, address):
    status, text = get(address, "/metrics")
    assert status == 200, text
    said = checked("promtool", "check", "metrics", input=text)
    assert said == "", f"{job}: promtool: {said}"
    labels = {value for name, value in re.findall(r'(\w+)="([^"]*)"', text) if name != "le"}
    assert not [value for value in labels if re.search("[0-9a-f]{16}", value)], f"the id of a client is in a label: {labels}"
    print(f"{job}: {len(values(text))} series in {len(text)} bytes, {values(text)['tandem_scrape_duration_seconds'] * 1e3:.2f} ms")


def run_rules(stage):
    """Needs no session."""
    checked("promtool", "check", "config", DEPLOYED / "prometheus.yml")
    for name in RULES:
        checked("promtool", "check", "rules", DEPLOYED / name)
    tested, named = alerts.check(DEPLOYED / "alerts.rules.yml", stage.folder)
    written = set(re.findall(r"- alert: (\w+)", (DEPLOYED / "alerts.rules.yml").read_text("utf-8")))
    assert written == named, f"alerts without a test, or tests without an alert: {written ^ named}"
    print(f"{tested} cases: each alert fires within {alerts.FIRES_S} s of its fault, alone, after an hour of silence")


def run_session(stage, hurried=True):
    places = stage.session()
    for job, address in places.items():
        wait_for(lambda at=address: get(at, "/readyz") == (200, "ready\n"), f"{job} ready")
        assert get(address, "/healthz") == (200, "alive\n")
        check_page(job, address)
    prometheus = Prometheus(stage, places, hurried)
    wait_for(lambda: len(prometheus.query("tandem_ready == 1")) == 3, "three programs that are scraped")
    wait_for(lambda: prometheus.query("instance:tandem_frame_duration_seconds:p99_5m > 0"), "the recording rules")
    prometheus.wait_for_silence()  # the histograms of the first seconds
    check_queries(prometheus)
    assert not prometheus.firing(), prometheus.firing()

    stage.signal("server", signal.SIGSTOP)
    prometheus.wait_for_alert("TandemGone")
    assert get(places["tandemd"], "/healthz", 1)[0] == 0, "a stopped server answers nothing"
    for job in ("tandem-gateway", "tandem-recorder"):
        wait_for(lambda at=places[job]: get(at, "/readyz")[0] == 503, f"{job} without frames")
        assert get(places[job], "/healthz")[0] == 200
    if hurried:  # it waits a minute otherwise
        prometheus.wait_for_alert("TandemNotReady")
    stage.signal("server", signal.SIGCONT)
    for job, address in places.items():
        wait_for(lambda at=address: get(at, "/readyz")[0] == 200, f"{job} ready again")
    prometheus.wait_for_silence()

    with Halting(stage.processes["participant"]):  # and no stall timeout, so the server waits for it
        prometheus.wait_for_alert("TandemRateNotHeld")
        status, said = get(places["tandemd"], "/readyz")
        assert (status, said) == (503, "it publishes fewer frames than are due\n"), said
        assert get(places["tandemd"], "/healthz")[0] == 200
    wait_for(lambda: get(places["tandemd"], "/readyz")[0] == 200, "the rate is held again")
    prometheus.wait_for_silence()

    stage.signal("server", signal.SIGKILL)
    prometheus.wait_for_alert("TandemGone")
    prometheus.wait_for_alert("TandemServerLost")


def open_to(address):
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)), timeout=10)


def raw(address, request):
    """The answer to any bytes; what came before the connection ended."""
    with open_to(address) as connection:
        answer = b""
        try:
            connection.sendall(request)
            while piece := connection.recv(65536):
                answer += piece
        except ConnectionError:
            pass
        return answer


def check_bad_requests(address):
    assert raw(address, b"GET /nothing HTTP/1.1\r\n\r\n").startswith(b"HTTP/1.1 404 ")
    assert raw(address, b"POST /metrics HTTP/1.1\r\nContent-Length: 4\r\n\r\nabcd").startswith(b"HTTP/1.1 405 ")
    assert raw(address, b"\x16\x03\x01\x02\x00\r\n\r\n").startswith(b"HTTP/1.1 400 ")
    head = raw(address, b"HEAD /metrics HTTP/1.1\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200 ") and head.endswith(b"\r\n\r\n"), head
    large = raw(address, b"GET /metrics HTTP/1.1\r\nX: " + b"x" * 10_000_000)
    assert large == b"" or large.startswith(b"HTTP/1.1 431 "), large[:100]
    began = time.monotonic()
    assert raw(address, b"GET /metrics HTTP/1.1\r\nX: ") == b"", "headers that never end"
    assert 4 < time.monotonic() - began < 9
    print("bad requests: answered or ended", flush=True)


def check_crowd(address):
    """Many that send nothing and many that read nothing, and a scraper still gets its page."""
    silent = [open_to(address) for _ in range(100)]
    deaf = [open_to(address) for _ in range(100)]
    for connection in deaf:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.sendall(b"GET /metrics HTTP/1.1\r\n\r\n")
    began = time.monotonic()
    status, text = get(address, "/metrics", 5)
    assert status == 200, text
    taken_s = time.monotonic() - began
    open_files = values(text)["process_open_fds"]
    assert open_files < 100, open_files
    for connection in silent + deaf:
        connection.close()
    print(f"200 connections: the page comes after {taken_s * 1e3:.0f} ms; {open_files:.0f} open files", flush=True)


def run_strangers(stage):
    """A port in use, wrong addresses, and requests from anybody."""
    address = stage.server(10000)
    port = address.rsplit(":", 1)[1]
    wait_for(lambda: get(address, "/readyz")[0] == 200, "ready")
    programs = (
        (stage.options.tandemd, "--scene", "half_pipe", "--bodies", "10", "--session", "other"),
        (stage.options.gateway, "--port", "0", "--viewer", ""),
        (stage.options.tandem, "record", stage.folder / "other.mcap"),
    )
    for program in programs:
        for value, code, said in ((port, 1, "Address already in use"), ("127.0.0.1:99999", 2, "PORT"), ("host:1", 2, "PORT")):
            done = subprocess.run(
                [*map(str, program), "--metrics", value], capture_output=True, text=True, env=ENVIRONMENT, timeout=LIMIT_S, check=False
            )
            lines = [line for line in done.stderr.splitlines() if "Run with --help" not in line and "[warning]" not in line]
            assert done.returncode == code and len(lines) == 1 and said in lines[0], (program, value, done.returncode, done.stderr)
    print(f"a port in use: {lines and 'one line'}, exit 1; a wrong address: exit 2", flush=True)
    check_bad_requests(address)
    check_crowd(address)

    seconds, asked, stop = 5, [0] * 4, threading.Event()

    def scrape(index):
        while not stop.is_set():
            raw(address, b"GET /metrics HTTP/1.1\r\n\r\n")
            asked[index] += 1

    before = values(get(address, "/metrics")[1])
    began = time.monotonic()
    threads = [threading.Thread(target=scrape, args=(i,)) for i in range(len(asked))]
    for thread in threads:
        thread.start()
    time.sleep(seconds)
    status, text = get(address, "/metrics", 10)
    stop.set()
    for thread in threads:
        thread.join()
    assert status == 200
    after, took_s = values(text), time.monotonic() - began
    rate_hz = (after["tandem_frames_total"] - before["tandem_frames_total"]) / took_s
    cpu = (after["process_cpu_seconds_total"] - before["process_cpu_seconds_total"]) / took_s
    print(f"{sum(asked) / took_s:.0f} scrapes/s: {rate_hz:.1f} frames/s, {cpu * 100:.1f} % of a core in all", flush=True)
    assert rate_hz > 28, f"{rate_hz:.1f} frames/s under a flood of scrapes"


def run_deployed(stage):
    """The same with the intervals and times that are deployed, which takes minutes."""
    run_session(stage, hurried=False)


SCENARIOS = {
    "rules": run_rules, "session": run_session, "deployed": run_deployed, "faults": faults.run, "links": links.run,
    "silence": silence.run, "strangers": run_strangers,
}  # fmt: skip


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scenario", choices=SCENARIOS)
    parser.add_argument("--tandemd", required=True)
    parser.add_argument("--tandem", required=True)
    parser.add_argument("--gateway", required=True)
    parser.add_argument("--wrong-hashes", required=True, help="a server that announces wrong hashes")
    parser.add_argument("--minutes", type=float, default=10, help="of `silence`")
    options = parser.parse_args()
    if options.scenario != "strangers" and not (shutil.which("prometheus") and shutil.which("promtool")):
        print("not run: the package prometheus is missing")
        return NOT_RUN
    with tempfile.TemporaryDirectory() as folder, Stage(options, folder) as stage:
        return SCENARIOS[options.scenario](stage) or 0


if __name__ == "__main__":
    sys.exit(main())
