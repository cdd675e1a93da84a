#!/usr/bin/env python3
"""tandem-gateway between a tandemd and viewers, over loopback DDS and WebSocket; hash logs are compared frame by frame.

gateway_test.py SCENARIO --tandemd PATH --tandem PATH --gateway PATH --viewer PATH        Exit 0 passed, 1 failed.
"""

import argparse
import json
import pathlib
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "session"))
from stage import Failed, Stage, check_report, compare  # noqa: E402

TOKEN = "a-token-of-enough-characters"


class WebStage(Stage):
    """Its viewers know no DDS: they get no domain."""

    port = 0

    def gateway(self, name, *arguments):
        """A gateway on the port of the one before, so that viewers find it again."""
        site = self.folder / "site"
        site.mkdir(exist_ok=True)
        (site / "index.html").write_text("<p>viewer", encoding="ascii")
        self.start(name, self.options.gateway, "--port", self.port, "--viewer", site, *arguments)
        said = self.folder / f"{name}.err"
        self.wait(lambda: re.search(r"https?://.*:(\d+)/", said.read_text()), f"{name} to listen")
        self.port = int(re.search(r"https?://.*:(\d+)/", said.read_text())[1])

    def viewer(self, name, *arguments, log=True):
        common, self.common = self.common, []
        hashes = ("--hash-log", self.log(name)) if log else ()
        self.start(name, self.options.viewer, "--port", self.port, *hashes, *arguments)
        self.common = common

    def get(self, path="/", **headers):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:
                return answer.status, answer.read(), answer.headers
        except urllib.error.HTTPError as error:
            return error.code, error.read(), error.headers

    def health(self):
        return json.loads(self.get("/healthz")[1])


def check_viewer(stage, name, servers, least, report, resyncs=0):
    if report["hash_mismatches"] or report["refused_messages"] or report["resyncs"] > resyncs:
        raise Failed(f"{name}: {report}")
    compare(stage, servers, name, least, report["resyncs"] + report["connections"] - 1)
    print(f"  joined in {report['join_ms']:.0f} ms, round trip {report['round_trip_ms']:.1f} ms")


def check_top(stage, count):
    """`tandem top`, which hears DDS alone, shows each viewer and whose it is."""
    command = [stage.options.tandem, "top", "--once", "--json", "--listen", "4", *stage.common]
    done = subprocess.run(command, capture_output=True, text=True, env=stage.environment, timeout=60, check=True)
    clients = json.loads(done.stdout)["clients"]
    shown = [client for client in clients if "gateway" in client]
    if len(shown) != count or len({client["gateway"] for client in shown}) != 1:
        raise Failed(f"{len(shown)} viewers are shown: {clients}")
    if shown[0]["gateway"] not in {client["client"] for client in clients if "gateway" not in client}:
        raise Failed(f"the gateway is not shown: {clients}")


def viewers(stage):
    """Two viewers with inputs, one that sleeps, one that comes late, a client of DDS: all hold the server's state."""
    stage.server("server")
    stage.gateway("gateway")
    stage.client("native")
    stage.viewer("tilts", "--seconds", 18, "--input-every", 0.21)
    stage.viewer("pushes", "--seconds", 18, "--input-every", 0.35)
    stage.viewer("sleeps", "--seconds", 60, "--sleep-after", 1, log=False)
    stage.wait(lambda: stage.health()["viewers"] == 3 and stage.health()["phase"] == "playing", "three viewers")
    stage.wait(lambda: len(stage.hashes("tilts")) > 100, "100 frames")
    stage.viewer("late", "--seconds", 12)
    stage.wait(lambda: stage.health()["viewers"] == 4, "four viewers")
    check_top(stage, 4)
    reports = {name: stage.end(name) for name in ("tilts", "pushes", "late")}
    health = stage.health()
    check_report(stage.stop("native"))
    server = stage.stop("server")
    for name, report in reports.items():
        check_viewer(stage, name, ["server"], 300 if name != "late" else 200, report)
        if report["role"] != "participant" or not report["server_status"]:
            raise Failed(f"{name}: {report}")
    compare(stage, ["server"], "native", 300)
    for name in ("tilts", "pushes"):
        sent = [reports[name][f"inputs_{what}"] for what in ("sent", "acted", "refused", "unknown")]
        print(f"  inputs of {name}: {sent[0]} sent, {sent[1]} acted, {sent[2]} refused, {sent[3]} unknown")
        # The last ones may still be under way.
        if sent[0] < 30 or sent[1] < sent[0] - 3 or sent[2] or sent[3]:
            raise Failed(f"{name} was told otherwise")
    if server["stalls"] > 0 and server["demotions"] > 0:
        raise Failed("the world waited for a viewer")
    if health["snapshots"] > 4:
        raise Failed(f"{health['snapshots']} snapshots for 4 viewers")
    status, page, headers = stage.get("/")
    if (status, page, headers["content-type"]) != (200, b"<p>viewer", "text/html; charset=utf-8"):
        raise Failed("the page is not served")
    if stage.processes["gateway"].poll() is not None:
        raise Failed("the gateway ended")


def restarts(stage):
    """Server and gateway are killed and started again: viewers play again by themselves."""
    stage.server("before")
    stage.gateway("first")
    stage.viewer("viewer", "--seconds", 25)
    stage.wait(lambda: len(stage.hashes("viewer")) > 60, "60 frames")
    stage.kill("before")
    stage.wait(lambda: not stage.health()["server_alive"], "the gateway to say that the server is gone")
    stage.wait(lambda: stage.health()["phase"] == "playing", "the gateway to go on")
    stage.server("after")

    def frames_of_the_new_run():
        epochs = {epoch for epoch, _ in stage.hashes("after")}
        return sum(1 for epoch, _ in stage.hashes("viewer") if epoch in epochs)

    stage.wait(lambda: frames_of_the_new_run() > 60, "60 frames of the new run")
    stage.kill("first")
    count = frames_of_the_new_run()
    stage.gateway("second")
    stage.wait(lambda: frames_of_the_new_run() > count + 60, "60 frames through the second gateway")
    report = stage.end("viewer")
    stage.stop("after")
    if report["connections"] < 2:
        raise Failed(f"one connection only: {report}")
    # The second gateway lacks the frames in between, which DDS does not give twice.
    check_viewer(stage, "viewer", ["before", "after"], 180, report, resyncs=1)


def raw(port, head, body=b"", enough=lambda _: False):
    """What is answered to a connection that is not a good client, until that is `enough`, or nothing comes for 3 s."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(head + body)
        connection.settimeout(3)
        got = b""
        try:
            while not enough(got) and (piece := connection.recv(4096)):
                got += piece
        except (TimeoutError, ConnectionError):
            pass
        return got


def refusals(stage):
    """Bad connections and messages are refused with code and reason and counted, and nobody else notices."""
    token = stage.folder / "token"
    token.write_text(TOKEN + "\n", encoding="ascii")
    stage.server("server")
    stage.gateway("gateway", "--token-file", token, "--origin", "https://lab.example", "--max-viewers", 2)
    query = ("--query", f"?token={TOKEN}")
    stage.viewer("good", "--seconds", 14, *query)
    stage.wait(lambda: len(stage.hashes("good")) > 30, "a viewer to play")

    def refused(name, code, *arguments):
        stage.viewer(name, "--once", "--seconds", 5, "--timeout", 10, *arguments, log=False)
        report = stage.end(name)
        if report["frames_applied"] or [close["code"] for close in report["closed"]] != [code]:
            raise Failed(f"{name}: {report}")
        print(f"  {name}: {report['closed'][0]}")

    refused("no token", 4001)
    refused("wrong token", 4001, "--query", f"?token={TOKEN[:-1]}x")
    refused("wrong origin", 4002, *query, "--origin", "https://evil.example")
    refused("no message", 4004, *query, "--zeros", 40)
    refused("too large", 1009, *query, "--zeros", 100_000)
    stage.viewer("listed", "--seconds", 4, *query, "--origin", "https://lab.example")
    stage.wait(lambda: len(stage.hashes("listed")) > 10, "a page of a listed origin")
    refused("one too many", 4003, *query)

    upgrade = (
        b"GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n%s\r\n"
    )
    for status, path, protocol in (
        (b" 404 ", b"/other", b"Sec-WebSocket-Protocol: tandem.4\r\n"),
        (b" 400 ", b"/tandem", b""),
        (b" 400 ", b"/tandem", b"Sec-WebSocket-Protocol: tandem.9\r\n"),
        (b" 400 ", b"/tandem", b"Sec-WebSocket-Protocol: http\r\n"),
        (b" 101 ", b"/tandem", b"Sec-WebSocket-Protocol: tandem.9, tandem.4\r\n"),
    ):
        answer = raw(stage.port, upgrade % (path, protocol))
        if status not in answer[:20]:
            raise Failed(f"{path} with {protocol}: {answer[:200]}")
    raw(stage.port, b"\x16\x03\x01" + bytes(range(256)) * 20)
    raw(stage.port, b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\n\r\n")
    for path in ("/../token", "/%2e%2e/token", "//etc/passwd", "/site/../../token"):
        if stage.get(path)[0] != 404:
            raise Failed(f"{path} is served")
    if b"405" not in raw(stage.port, b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\nx")[:20]:
        raise Failed("POST is not refused")

    report = stage.end("good")
    stage.end("listed")
    counted = stage.health()["refused"]
    stage.stop("server")
    check_viewer(stage, "good", ["server"], 200, report)
    wanted = {"token missing or wrong": 3, "origin not allowed": 1, "too many viewers": 1, "malformed message": 1,
              "message too large": 1}  # fmt: skip
    if any(counted[reason] != count for reason, count in wanted.items()):
        raise Failed(f"counted: {counted}")
    said = (stage.folder / "gateway.err").read_text()
    if said.count("refused") > 15:  # 5 lines of the audit log at once, one in 2 s, and one with all counts a minute
        raise Failed(f"the log is full of it: {said}")

    def ends(code, *arguments):
        stage.start("usage", stage.options.gateway, *arguments)
        got = stage.processes["usage"].wait(60)
        said = (stage.folder / "usage.err").read_text().strip()
        if got != code or len(said.splitlines()) > 2 or not said:
            raise Failed(f"{arguments}: exit {got}, {said!r}")
        print(f"  {said.splitlines()[-1]}")

    short = stage.folder / "short"
    short.write_text("x\n", encoding="ascii")
    ends(1, "--port", stage.port)
    ends(1, "--listen", "192.0.2.1")
    ends(1, "--listen", "nonsense")
    ends(1, "--port", 0, "--tls-cert", token, "--tls-key", token)
    ends(2, "--token-file", short)
    ends(2, "--token-file", stage.folder / "missing")
    ends(2, "--viewer", stage.folder / "missing")
    ends(2, "--origin", "lab.example")
    ends(2, "--tls-cert", token)
    ends(2, "--session", "a*")
    ends(2, "--max-viewers", 0)
    ends(2, "--no-such-flag")


def certificate(stage, name):
    """For `localhost`, and its own authority."""
    cert, key = stage.folder / f"{name}.crt", stage.folder / f"{name}.key"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
         "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", key, "-out", cert],
        check=True, capture_output=True,
    )  # fmt: skip
    return cert, key


def entrance(stage):
    """Through TLS with a token, and over IPv6: viewers hold the server's state, and connections without TLS or token are refused."""
    token = stage.folder / "token"
    token.write_text(TOKEN + "\n", encoding="ascii")
    cert, key = certificate(stage, "its own")
    stage.server("server")
    stage.gateway("six", "--listen", "::1")
    six, stage.port = stage.port, 0
    stage.gateway("tls", "--tls-cert", cert, "--tls-key", key, "--token-file", token)
    tls = stage.port
    stage.viewer("encrypted", "--seconds", 6, "--tls-ca", cert, "--query", f"?token={TOKEN}", "--input-every", 0.3)
    stage.port = six
    stage.viewer("over six", "--seconds", 6, "--address", "::1", "--input-every", 0.3)
    stage.port = tls
    stage.wait(lambda: len(stage.hashes("encrypted")) > 10, "a viewer to play through TLS")

    def refused(name, codes, *arguments):
        stage.viewer(name, "--once", "--seconds", 5, "--timeout", 10, *arguments, log=False)
        report = stage.end(name)
        if report["frames_applied"] or [close["code"] for close in report["closed"]] != codes:
            raise Failed(f"{name}: {report}")
        print(f"  {name}: {report['closed'] or 'no connection'}")

    refused("wrong token", [4001], "--tls-ca", cert, "--query", f"?token={TOKEN[:-1]}x")
    refused("unencrypted", [], "--query", f"?token={TOKEN}")
    other, _ = certificate(stage, "another")
    refused("another authority", [], "--tls-ca", other, "--query", f"?token={TOKEN}")
    if b"HTTP/1.1 200" in raw(tls, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"):
        raise Failed("served without TLS where there is TLS")
    trusted = ssl.create_default_context(cafile=cert)
    # By number: a bare system has no name for itself.
    with urllib.request.urlopen(f"https://127.0.0.1:{tls}/healthz", timeout=10, context=trusted) as answer:
        if json.load(answer)["refused"]["token missing or wrong"] != 1:
            raise Failed("the wrong token was not counted")
    with urllib.request.urlopen(f"http://[::1]:{six}/", timeout=10) as answer:
        if answer.read() != b"<p>viewer":
            raise Failed("the page is not served over IPv6")
    reports = {name: stage.end(name) for name in ("encrypted", "over six")}
    stage.stop("server")
    for name, report in reports.items():
        check_viewer(stage, name, ["server"], 120, report)
        if not report["inputs_acted"]:
            raise Failed(f"{name}: no input acted: {report}")


def sleeper(stage):
    """A viewer that reads nothing any more is let go after half a minute, and nobody else notices."""
    stage.server("server", "--codec", "none", bodies=10_000)  # 55 Mbit/s fill every buffer at once
    stage.gateway("gateway")
    stage.viewer("awake", "--seconds", 45)
    stage.viewer("asleep", "--seconds", 60, "--sleep-after", 1, log=False)
    stage.wait(lambda: stage.health()["viewers"] == 2, "two viewers")
    stage.wait(lambda: stage.health()["refused"]["nothing was read for too long"] == 1, "the sleeper to be let go")
    played = len(stage.hashes("awake"))
    stage.wait(lambda: stage.health()["viewers"] == 1, "one viewer")
    print(f"  let go after {played} frames")
    if played < 600:
        raise Failed(f"let go after {played} frames")
    report = stage.end("awake")
    stage.stop("server")
    check_viewer(stage, "awake", ["server"], 900, report)


SCENARIOS = {scenario.__name__: scenario for scenario in (viewers, restarts, refusals, entrance, sleeper)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=SCENARIOS)
    for program in ("tandemd", "tandem", "gateway", "viewer"):
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
