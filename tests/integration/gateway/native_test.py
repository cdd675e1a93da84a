#!/usr/bin/env python3
"""Native clients that join over tandem-gateway by a URL, without DDS: the tool and Python; hash logs are compared frame by frame.

native_test.py SCENARIO --tandemd PATH --tandem PATH --gateway PATH --python-package FOLDER        Exit 0 passed, 1 failed.
"""

import argparse
import contextlib
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading

from gateway_test import TOKEN, Failed, WebStage, certificate, check_report, compare

PYTHON_CLIENT = """
import sys, time, tandem
with tandem.Client(url=sys.argv[1], token=sys.argv[2], tls_ca=sys.argv[3]) as client:
    client.wait_until_playing(30)
    number = client.send_gravity([3.0, -9.0, 0.0])
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline and not any(
        event.kind == tandem.EventKind.INPUT_ACTED and event.number == number for event in client.events()):
        time.sleep(0.05)
    print("acted", time.monotonic() < deadline, client.status().frame > 0, client.sample().alive.sum() > 0)
"""


def url(stage, scheme="ws", host="127.0.0.1", token=""):
    return f"{scheme}://{host}:{stage.port}/" + (f"#{token}" if token else "")


def joins(stage, name, *arguments):
    stage.client(name, *arguments)
    stage.wait(lambda: len(stage.hashes(name)) > 60, f"{name} to play 60 frames")


def plays(stage):
    """The tool acts and observes, and records; each holds the server's state. A client of Python acts."""
    stage.server("server")
    stage.gateway("gateway")
    tilts = stage.script("tilts", 7, 12, 0.3)
    joins(stage, "acts", "--url", url(stage), "--input-script", tilts)
    joins(stage, "watches", "--url", url(stage, "http"), "--observe")
    recording = stage.folder / "far.mcap"
    stage.start("records", stage.options.tandem, "record", recording, "--url", url(stage), "--hash-log", stage.log("records"), "--seconds", 4, "--json")
    said = run_python(stage, url(stage), "", "")
    if said.split() != ["acted", "True", "True", "True"]:
        raise Failed(f"the client of Python: {said!r}")
    recorded = stage.end("records")
    acts, watches = stage.stop("acts"), stage.stop("watches")
    stage.stop("server")
    for name, report in (("acts", acts), ("watches", watches), ("records", recorded)):
        check_report(report)
        compare(stage, ["server"], name, 60)
    if acts["role"] != "participant" or acts["inputs_acted"] < 10 or acts["inputs_unknown"]:
        raise Failed(f"who acts: {acts}")
    if watches["role"] != "observer":
        raise Failed(f"who watches: {watches}")
    print(f"  joined in {acts['join_ms']:.0f} ms, {acts['inputs_acted']} of {acts['inputs_sent']} inputs acted")


def waits(stage):
    """A client that lets its frames wait gets several with each message, holds the server's state, and nobody else waits."""
    stage.server("server")
    stage.gateway("gateway")

    def messages_of_a_frame(name, *arguments):
        joins(stage, name, "--url", url(stage), *arguments)
        began = stage.health()
        stage.wait(lambda: stage.health()["frame"] > began["frame"] + 150, "150 frames")
        ended = stage.health()
        return (ended["messages"] - began["messages"]) / (ended["frame"] - began["frame"])

    late = messages_of_a_frame("late", "--observe", "--max-delay", 0.5)
    both = messages_of_a_frame("prompt", "--max-delay", 0)
    reports = {name: stage.stop(name) for name in ("late", "prompt")}
    stage.stop("server")
    for name, report in reports.items():
        check_report(report)
        compare(stage, ["server"], name, 150)
    print(f"  messages of a frame: {late:.2f} with a delay of 0.5 s, {both:.2f} of it and one without")
    if late > 0.5 or both < late + 0.8:
        raise Failed("frames do not share messages as they should")


def run_python(stage, *arguments):
    environment = dict(os.environ, PYTHONPATH=str(stage.options.python_package))
    done = subprocess.run([sys.executable, "-c", PYTHON_CLIENT, *arguments], capture_output=True, text=True, timeout=60, env=environment, check=False)
    if done.returncode:
        raise Failed(f"the client of Python: {done.stderr}")
    return done.stdout


class Proxy:
    """An HTTP proxy that only knows CONNECT, as between many a building and the Internet."""

    def __init__(self):
        self.asked = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self.serve, args=(self.listener.accept()[0],), daemon=True).start()

    def serve(self, client):
        request = b""
        while b"\r\n\r\n" not in request:
            request += client.recv(4096)
        method, target, _ = request.decode().split(" ", 2)
        self.asked.append((method, target))
        host, port = target.rsplit(":", 1)
        server = socket.create_connection((host, int(port)), timeout=10)
        server.settimeout(None)
        client.sendall(b"HTTP/1.1 200 connected\r\n\r\n")
        threading.Thread(target=self.copy, args=(server, client), daemon=True).start()
        self.copy(client, server)

    @staticmethod
    def copy(a, b):
        with contextlib.suppress(OSError):
            while data := a.recv(65536):
                b.sendall(data)
            b.shutdown(socket.SHUT_WR)


def proxied(stage):
    """Through the proxy that http_proxy names."""
    proxy = Proxy()
    stage.server("server")
    stage.gateway("gateway")
    stage.environment["http_proxy"] = f"127.0.0.1:{proxy.port}"
    joins(stage, "client", "--url", url(stage))
    check_report(stage.stop("client"))
    stage.stop("server")
    compare(stage, ["server"], "client", 60)
    if proxy.asked != [("CONNECT", f"127.0.0.1:{stage.port}")]:
        raise Failed(f"the proxy was asked for {proxy.asked}")


def restarts(stage):
    """Gateway and server are killed and started again: a client plays again by itself, and is told why it did not."""
    stage.server("before")
    stage.gateway("first")
    joins(stage, "client", "--url", url(stage))
    stage.kill("first")
    said = stage.folder / "client.err"
    stage.wait(lambda: "was lost" in said.read_text(), "the client to say that the connection was lost")
    stage.gateway("second")
    count = len(stage.hashes("client"))
    stage.wait(lambda: len(stage.hashes("client")) > count + 60, "60 frames over the second gateway")
    stage.kill("before")
    stage.server("after")

    def of_the_new_run():
        epochs = {epoch for epoch, _ in stage.hashes("after")}
        return sum(1 for epoch, _ in stage.hashes("client") if epoch in epochs)

    stage.wait(lambda: of_the_new_run() > 60, "60 frames of the new run")
    report = stage.stop("client")
    stage.stop("after")
    if report["hash_mismatches"]:
        raise Failed(f"{report}")
    compare(stage, ["before", "after"], "client", 180, report["resyncs"] + 1)


def entrance(stage):
    """TLS and tokens: who has both plays; who lacks one is told what is wrong, in one line, and gets nothing."""
    token = stage.folder / "token"
    token.write_text(TOKEN + "\n", encoding="ascii")
    wrong = stage.folder / "wrong"
    wrong.write_text("another-token-of-enough-characters\n", encoding="ascii")
    cert, key = certificate(stage, "its own")
    foreign, _ = certificate(stage, "foreign")
    stage.server("server")
    stage.gateway("gateway", "--tls-cert", cert, "--tls-key", key, "--token-file", token)
    there = url(stage, "wss", "localhost")
    joins(stage, "good", "--url", there, "--token-file", token, "--tls-ca", cert)
    joins(stage, "pasted", "--url", url(stage, "https", "localhost", TOKEN), "--tls-ca", cert)
    said = run_python(stage, there, TOKEN, str(cert))
    if not said.startswith("acted True"):
        raise Failed(f"the client of Python: {said!r}")
    for what, arguments, reason in (
        ("no token", ["--url", there, "--tls-ca", cert], "(4001)"),
        ("a wrong token", ["--url", there, "--tls-ca", cert, "--token-file", wrong], "(4001)"),
        ("another authority", ["--url", there, "--token-file", token, "--tls-ca", foreign], "no TLS with"),
        ("the system's authorities", ["--url", there, "--token-file", token], "no TLS with"),
        ("no TLS", ["--url", url(stage, "ws", "localhost"), "--token-file", token], "no gateway answers"),
        ("no gateway there", ["--url", "ws://127.0.0.1:1/"], "no gateway answers"),
        ("another path", ["--url", f"wss://localhost:{stage.port}/elsewhere/", "--tls-ca", cert], "HTTP 404"),
        ("no URL", ["--url", "localhost:80"], "a url is wss://"),
        ("no certificate", ["--url", there, "--tls-ca", token], "no certificate (PEM)"),
    ):
        done = subprocess.run(
            [stage.options.tandem, "join", "--timeout", "4", *map(str, arguments)], capture_output=True, text=True, timeout=60, check=False)
        last = done.stderr.strip().splitlines()[-1] if done.stderr else ""
        print(f"  {what}: {last}", flush=True)
        if done.returncode != 1 or reason not in last:
            raise Failed(f"{what}: exit {done.returncode}: {done.stderr}")
        if TOKEN in done.stderr or "another-token" in done.stderr:
            raise Failed(f"{what}: the token is in the log")
    for name in ("good", "pasted"):
        check_report(stage.stop(name))
    stage.stop("server")
    compare(stage, ["server"], "good", 60)


SCENARIOS = {scenario.__name__: scenario for scenario in (plays, waits, proxied, restarts, entrance)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=SCENARIOS)
    for program in ("tandemd", "tandem", "gateway", "python-package"):
        parser.add_argument(f"--{program}", required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with WebStage(options, folder) as stage:
                SCENARIOS[options.scenario](stage)
        except Failed as error:
            print(f"{options.scenario}: {error}", file=sys.stderr)
            return 1
    print(f"{options.scenario}: passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
