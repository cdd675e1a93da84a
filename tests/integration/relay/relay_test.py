#!/usr/bin/env python3
"""A session over NATS: tandemd, tandem-relay, nats-server as deploy/nats has it, a relay and a gateway at other sites.

relay_test.py SCENARIO --tandemd PATH --tandem PATH --relay PATH --gateway PATH --viewer PATH        Exit 0 passed, 1 failed, 77 skipped.
"""

import argparse
import contextlib
import json
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent), str(pathlib.Path(__file__).resolve().parents[1] / "gateway")]
import audience as folders  # noqa: E402
import credentials  # noqa: E402
import nats  # noqa: E402
from gateway_test import Failed, WebStage, check_report, compare  # noqa: E402

SKIPPED = 77
WATCHED = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "metrics"


class Sites(WebStage):
    """The server's domain, a hub and the leaf node of site north on loopback, and the domain of that site."""

    def __init__(self, options, folder):
        super().__init__(options, folder)
        self.far_domain = ["--domain", str(int(self.common[1]) + 100)]
        self.hub_port, self.leaf_port, self.north_port, self.metrics_port, self.far_metrics_port = nats.free_ports(5)
        self.hub = nats.Server(folder, "hub", "hub", self.hub_port, self.leaf_port)
        self.north = nats.Server(folder, "leaf", "north", self.north_port, hub=f"nats-leaf://north:n@127.0.0.1:{self.leaf_port}")

    def __exit__(self, *why):
        super().__exit__(*why)
        for server in (self.hub, self.north):
            server.kill()

    def at_hub(self, user, password):
        return f"nats://{user}:{password}@127.0.0.1:{self.hub_port}"

    @contextlib.contextmanager
    def far(self):
        """What is started meanwhile is on the domain of the other site."""
        here, self.common = self.common, self.far_domain
        try:
            yield
        finally:
            self.common = here

    @contextlib.contextmanager
    def elsewhere(self):
        """What is started meanwhile knows no DDS."""
        here, self.common = self.common, []
        try:
            yield
        finally:
            self.common = here

    def relays(self, between=lambda: None):
        self.start("near", self.options.relay, "--from", "dds", "--to", self.at_hub("server", "s"), "--site", "server", "--metrics", self.metrics_port)
        between()
        with self.far():
            self.start("far", self.options.relay, "--from", f"nats://127.0.0.1:{self.north_port}", "--to", "dds", "--site", "north", "--metrics", self.far_metrics_port)

    def page(self, port):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as answer:
            return answer.read().decode()

    def metric(self, name):
        for line in self.page(self.metrics_port).splitlines():
            if line.startswith(name + " ") or line.startswith(name + "{"):
                return float(line.split()[-1])
        raise Failed(f"no metric {name}")

    def check_watched(self):
        """What the deployed rules and the dashboard name of relays is told by the one or the other."""
        told = set(re.findall(r"^(tandem_relay_\w+)", self.page(self.metrics_port) + self.page(self.far_metrics_port), re.MULTILINE))
        named = {name for file in sorted(WATCHED.iterdir()) if file.suffix in (".yml", ".json") for name in re.findall(r"tandem_relay_\w+", file.read_text())}
        if not named or named - told:
            raise Failed(f"deploy/metrics names what no relay tells: {sorted(named - told)}")

    def plays(self, name, frames=60):
        before = len(self.hashes(name))
        self.wait(lambda: len(self.hashes(name)) >= before + frames, f"{name} to play {frames} frames")


def sites(stage):
    """Native clients of another domain and browsers over the gateway hold the server's state; inputs act; the hub may be killed, the server too."""
    stage.server("server")
    stage.relays()
    stage.gateway("gateway", "--from", stage.at_hub("south", "o"), "--site", "south")
    stage.client("native")
    with stage.far():
        stage.client("acts", "--input-script", stage.script("tilts", 7, 10, 0.4))
        stage.client("watches", "--observe")
        stage.plays("watches")
    with stage.elsewhere():
        stage.start("web", stage.options.tandem, "join", "--json", "--live", "--hash-log", stage.log("web"), "--url", f"ws://127.0.0.1:{stage.port}/")
    stage.plays("web")
    stage.plays("acts", 150)
    before = time.monotonic()
    stage.hub.kill()
    time.sleep(2)
    stage.hub.start()
    repaired = time.monotonic()
    for name in ("acts", "web"):
        stage.plays(name, 90)
    print(f"  hub away for {repaired - before:.1f} s; 90 frames later {time.monotonic() - repaired:.1f} s after it was back")
    stage.check_watched()
    if stage.metric("tandem_relay_repeated_bytes_total") <= 0:
        raise Failed("nothing was asked for after the hub was killed")
    reports = {"acts": stage.stop("acts")}
    epochs = {epoch for epoch, _ in stage.hashes("web")}
    stage.kill("server")
    stage.server("anew")
    for name in ("web", "native", "watches"):
        stage.wait(lambda name=name: sum(epoch not in epochs for epoch, _ in stage.hashes(name)) > 30, f"{name} to follow the server that began anew")
    reports.update({name: stage.stop(name) for name in ("web", "native", "watches")})
    stage.stop("anew")
    for name, report in reports.items():
        check_report(report)
        if report["resyncs"]:
            raise Failed(f"{name} joined anew: {report}")
        compare(stage, ["server", "anew"], name, 200)
    if reports["acts"]["inputs_acted"] < 8 or reports["acts"]["inputs_unknown"] > 2:
        raise Failed(f"inputs: {reports['acts']}")
    print(f"  {reports['acts']['inputs_acted']} of {reports['acts']['inputs_sent']} inputs acted, latency {reports['acts']['input_latency_ms']}")


def strangers(stage):
    """Who may only watch cannot publish deltas, nor speak for another site, directly or over a leaf node, nor keep sites out by names that it makes up."""

    def makes_up_sites():
        stage.wait(lambda: stage.says("near", "passes on session"), "the relay to publish")
        storm = nats.Client(stage.hub_port, "south", "o")
        for number in range(1100):
            storm.publish("tandem.default.hello", b"\x02\x00\x01\x00\x00\x00\x23" + f"made-up-{number}".encode())
        storm.flush()
        storm.close()

    stage.server("server")
    stage.relays(makes_up_sites)
    with stage.far():
        stage.client("watches", "--observe")
    stage.plays("watches")
    listens = nats.Client(stage.hub_port, "south", "o")
    listens.subscribe("tandem.default.to.north.>", 1)
    for client in (nats.Client(stage.hub_port, "north", "n"), nats.Client(stage.north_port)):
        for what in ("delta.0", "beat", "inputs", "status", "to.south.0000000000000001", "from.south.0000000000000001"):
            client.publish(f"tandem.default.{what}", b"\x02\x00\x01\x00\x00\x00\x02" + bytes(60))
        client.flush()
        client.close()
    refused = nats.Client(stage.hub_port, "north", "n")
    refused.publish("tandem.default.delta.0", b"forged")
    refused.flush()
    if not any("Permissions Violation" in error for error in refused.errors):
        raise Failed(f"a viewer's site may publish deltas: {refused.errors}")
    stage.plays("watches", 90)
    listens.read(lambda: False, 0.5)
    if listens.messages or not listens.errors:
        raise Failed(f"one site hears what is for another: {listens.messages[:1]} {listens.errors}")
    report = stage.stop("watches")
    stage.stop("server")
    check_report(report)
    if stage.metric("tandem_relay_connections_lost_total") > 0:
        raise Failed("the NATS server cut the relay")
    if report["resyncs"] or stage.metric("tandem_relay_malformed_total") > 0:
        raise Failed(f"a stranger was heard: {report}")
    compare(stage, ["server"], "watches", 120)


def audience(stage):
    """A relay straight into an audience's folder has every frame with the server's hash, through a dead hub, and goes on after kill -9 and a new epoch."""
    folder = stage.folder / "live"
    stage.server("server")
    stage.start("near", stage.options.relay, "--from", "dds", "--to", stage.at_hub("server", "s"), "--site", "server")

    def writes(name):
        with stage.elsewhere():
            stage.start(name, stage.options.relay, "--from", stage.at_hub("south", "o"), "--site", "south",
                        "--to", "http", folder, "--keep", 600, "--metrics", stage.metrics_port)  # fmt: skip

    def frames(least):
        """The frames that are there, once there are so many more."""
        before = len(folders.hashes(folder)) if (folder / "manifest.json").exists() else 0
        stage.wait(lambda: (folder / "manifest.json").exists() and len(folders.hashes(folder)) >= before + least, f"{least} more frames in the folder")

    writes("first")
    frames(150)
    runs = len(folders.manifest(folder)["runs"])
    stage.hub.kill()
    time.sleep(1.5)
    stage.hub.start()
    frames(120)
    if len(folders.manifest(folder)["runs"]) != runs:
        raise Failed("a hub that was away for 1.5 s left a gap")
    kept = folders.hashes(folder)
    compare_maps(stage.hashes("server"), kept, 250)
    first = folders.manifest(folder)
    stage.kill("first")
    writes("second")
    stage.wait(lambda: folders.manifest(folder)["writer"] > first["writer"], "another writer's manifest")
    frames(60)
    stage.kill("server")
    stage.server("anew")
    stage.wait(lambda: len({epoch for epoch, _ in folders.hashes(folder)}) == 2, "the new epoch")
    frames(60)
    if stage.metric("tandem_relay_segments_total") < 3 or stage.metric("tandem_relay_publishes") != 1:
        raise Failed("the metrics do not tell of the folder")
    stage.processes["second"].terminate()
    if stage.processes["second"].wait(20) != 0:
        raise Failed("the relay did not end by itself")
    if folders.manifest(folder)["state"] != "ended":
        raise Failed("the manifest does not say that it ended")
    stage.stop("anew")
    compare_maps({**stage.hashes("server"), **stage.hashes("anew")}, folders.hashes(folder), 120)
    for wrong in (["--to", "http"], ["--to", "dds", folder], ["--to", "http", folder, "--keep", "-1"]):
        done = subprocess.run([stage.options.relay, "--from", "nats://127.0.0.1:1", *wrong], capture_output=True, timeout=20, check=False)
        if done.returncode != 2:
            raise Failed(f"{wrong} is not refused: {done}")


def standby(stage):
    """Of two relays beside the server the second takes over when the first is killed, and nobody behind them joins anew."""
    stage.server("server")
    stage.relays()
    with stage.far():
        stage.client("watches", "--observe")
    stage.gateway("gateway", "--from", stage.at_hub("south", "o"), "--site", "south")
    with stage.elsewhere():
        stage.start("web", stage.options.tandem, "join", "--json", "--live", "--hash-log", stage.log("web"), "--url", f"ws://127.0.0.1:{stage.port}/")
    stage.plays("watches")
    stage.plays("web")

    def relay(name):
        stage.start(name, stage.options.relay, "--from", "dds", "--to", stage.at_hub("server", "s"), "--site", "server")
        stage.wait(lambda: stage.says(name, "already has a server"), f"{name} to stand by")

    relay("second")
    time.sleep(3)  # it has some seconds of frames
    for dies in ("near", "second"):
        if dies == "second":
            relay("third")
            time.sleep(3)
        stage.kill(dies)
        killed = time.monotonic()
        for name in ("watches", "web"):
            stage.plays(name, 60)
        print(f"  60 frames {time.monotonic() - killed:.1f} s after {dies} was killed")
    reports = {name: stage.stop(name) for name in ("web", "watches")}
    stage.stop("server")
    for name, report in reports.items():
        check_report(report)
        if report["resyncs"]:
            raise Failed(f"{name} joined anew: {report}")
        compare(stage, ["server"], name, 200)


def restarts(stage):
    """Native clients of a site go on when its relay is killed: with another that stands by, and with the state that a relay kept."""
    stage.server("server")
    stage.start("near", stage.options.relay, "--from", "dds", "--to", stage.at_hub("server", "s"), "--site", "server", "--metrics", stage.metrics_port)

    def far(name):
        with stage.far():
            stage.start(name, stage.options.relay, "--from", f"nats://127.0.0.1:{stage.north_port}", "--to", "dds", "--site", "north", "--state", stage.folder / "state")

    far("far")
    with stage.far():
        stage.client("acts", "--input-script", stage.script("tilts", 7, 60, 0.5))
        stage.client("watches", "--observe")
    stage.plays("watches")
    stage.wait((stage.folder / "state").exists, "the relay to keep its state")
    snapshots = stage.metric("tandem_relay_snapshots_total")

    def dies(name, then):
        stage.kill(name)
        killed = time.monotonic()
        then()
        for client in ("watches", "acts"):
            stage.plays(client, 60)
        print(f"  60 frames {time.monotonic() - killed:.1f} s after {name} was killed")

    dies("far", lambda: far("again"))
    if stage.metric("tandem_relay_snapshots_total") != snapshots:
        raise Failed("the hub's relay was asked for a snapshot")
    far("second")
    stage.wait(lambda: stage.says("second", "already has a server"), "a relay to stand by")
    time.sleep(3)
    dies("again", lambda: None)
    reports = {name: stage.stop(name) for name in ("acts", "watches")}
    stage.stop("server")
    for name, report in reports.items():
        check_report(report)
        if report["resyncs"] or report["epochs"] != 1:
            raise Failed(f"{name} joined anew: {report}")
        compare(stage, ["server"], name, 200)


def edges(stage):
    """Who plays over a gateway goes on with what it holds when that is killed: with the state that the gateway kept, and with one that ran all the time."""
    stage.server("server")
    stage.start("near", stage.options.relay, "--from", "dds", "--to", stage.at_hub("server", "s"), "--site", "server", "--metrics", stage.metrics_port)
    state = ("--state", stage.folder / "state")

    def gateway(name):
        stage.gateway(name, "--from", stage.at_hub("south", "o"), "--site", "south", *state)

    gateway("first")
    with stage.elsewhere():
        stage.start("web", stage.options.tandem, "join", "--json", "--live", "--hash-log", stage.log("web"), "--url", f"ws://127.0.0.1:{stage.port}/", "--input-script", stage.script("tilts", 7, 60, 0.5))  # fmt: skip
    stage.viewer("browser", "--seconds", 35)
    for name in ("web", "browser"):
        stage.plays(name)
    stage.wait((stage.folder / "state").exists, "the gateway to keep its state")
    stage.wait(lambda: len(stage.hashes("web")) >= 210, "14 inputs to act")  # two a second
    snapshots = stage.metric("tandem_relay_snapshots_total")
    for dies, follows, away in (("first", "second", 9), ("second", "third", 1)):
        stage.kill(dies)
        time.sleep(away)
        newest = max(stage.hashes("server"))
        gateway(follows)
        back = time.monotonic()
        for name in ("web", "browser"):
            stage.wait(lambda name=name: newest in stage.hashes(name), f"{name} to have the frames of {away} s")
        print(f"  all frames of {away} s {time.monotonic() - back:.1f} s after the gateway was back")
        health = stage.health()
        if health["snapshots"] or health["resumed"] != 2:
            raise Failed(f"somebody joined the gateway anew: {health}")
    if stage.metric("tandem_relay_snapshots_total") != snapshots:
        raise Failed("the hub's relay was asked for a snapshot")
    enough = len(stage.hashes("web")) + 90
    stage.wait(lambda: len(stage.hashes("web")) >= enough, "6 inputs to act after the last gateway came")
    reports = {"web": stage.stop("web"), "browser": stage.end("browser")}
    stage.stop("server")
    for name, report in reports.items():
        if report["resyncs"] or report["hash_mismatches"]:
            raise Failed(f"{name} joined anew: {report}")
        compare(stage, ["server"], name, 450)
    if reports["browser"]["epochs"] != 1 or reports["browser"]["connections"] != 3:
        raise Failed(f"the browser's client began anew: {reports['browser']}")
    if reports["web"]["inputs_acted"] < 16:  # two a second: 13 of them before the first gateway is killed, 5 after the last came
        raise Failed(f"inputs do not act: {reports['web']}")
    print(f"  {reports['web']['inputs_acted']} of {reports['web']['inputs_sent']} inputs acted, {reports['web']['inputs_unknown']} are unknown")


def operators(stage):
    """`tandem doctor --nats` names each fault and its cure; `tandem top --nats` shows sessions and clients."""
    hub = stage.hub_port

    def doctor(url, *arguments):
        done = subprocess.run([stage.options.tandem, "doctor", "--json", "--nats", url, *arguments], capture_output=True, text=True, timeout=40, check=False)
        answer = json.loads(done.stdout)
        if done.returncode != (0 if answer["ok"] else 1):
            raise Failed(f"exit code {done.returncode}: {answer}")
        return answer["checks"]

    def expect(what, checks, name, verdict, *words):
        found = [check for check in checks if check["name"] == name]
        if not any(check["verdict"] == verdict and all(word in check["detail"] + check["advice"] for word in words) for check in found):
            raise Failed(f"{what}: expected {name} to be a {verdict} with {words}, got {checks}")

    (nobody,) = nats.free_ports(1)
    expect("nothing listens", doctor(f"nats://127.0.0.1:{nobody}"), "nats", "failure", "cannot be reached", "start nats-server")
    expect("wrong password", doctor(f"nats://north:wrong@127.0.0.1:{hub}"), "nats", "failure", "users.conf")
    expect("no TLS there", doctor(f"tls://north:n@127.0.0.1:{hub}"), "nats", "failure", "nats:// for one without")
    north = (f"nats://north:n@127.0.0.1:{hub}", "--site", "north")
    expect("no relay", doctor(*north), "session", "warning", "no relay announces one")
    expect("no such session", doctor(*north, "--session", "arena"), "session", "failure", "arena")
    foreign = doctor(f"nats://north:n@127.0.0.1:{hub}", "--site", "south")
    expect("another's name", foreign, "may follow", "failure", "listen on tandem.", ".to.south.", "publish on tandem.", ".from.south.", "--site")
    small = stage.folder / "small.conf"
    small.write_text(f'listen: "127.0.0.1:{nobody}"\nmax_payload: 2KB\n', encoding="ascii")
    with nats.plain(small, nobody):
        checks = doctor(f"nats://127.0.0.1:{nobody}")
        expect("small packets", checks, "max_payload", "failure", "2048 bytes", "64KB")
        expect("no users", checks, "may publish", "warning", "forge")
    stage.server("server")
    stage.relays()
    with stage.far():
        stage.client("watches", "--observe")
    stage.plays("watches")
    stage.gateway("gateway", "--from", stage.at_hub("south", "o"), "--site", "south")
    good = doctor(*north, "--session", "default")
    expect("a site", good, "session", "ok", "'default'", "1 relays")
    expect("a site", good, "may follow", "ok", "north")
    expect("a site", good, "may publish", "ok", "no session")
    expect("a site", good, "latency", "ok", "ms")
    expect("over the leaf", doctor(f"nats://127.0.0.1:{stage.north_port}", "--site", "north"), "session", "ok", "'default'")
    expect("the server's", doctor(stage.at_hub("server", "s"), "--site", "server"), "may follow", "warning", "right for the relay beside the server")
    forger = nats.Client(hub, "server", "s")

    def forged(packet):
        """Says it while doctor listens."""
        answer = []
        asks = threading.Thread(target=lambda: answer.extend(doctor(*north)))
        asks.start()
        while asks.is_alive():
            forger.publish("tandem.other.beat", packet)
            time.sleep(0.2)
        return answer

    expect("another version", forged(bytes([9, 0]) + bytes(40)), "version", "failure", "version 9")
    beat = bytes([32]) + struct.pack("<QQBQQB", 77, 1, 0, 1, 0, 0)
    answer = forged(struct.pack("<BBI", 2, 0, 5) + beat)
    expect("a relay that does not answer", answer, "session", "warning", "'other' is announced", "does not answer")
    forger.close()

    def top(url, *arguments):
        done = subprocess.run([stage.options.tandem, "top", "--once", "--json", "--listen", "6", "--nats", url, *arguments], capture_output=True, text=True, timeout=60, check=False)
        return done, json.loads(done.stdout)

    done, shown = top(f"nats://monitor:m@127.0.0.1:{hub}", "--site", "monitor")
    streams = [session for session in shown["sessions"] if session["session"] == "default"]
    if done.returncode or not streams or len(shown["clients"]) < 2:
        raise Failed(f"top does not show what relays publish: {done.stderr} {shown}")
    done, shown = top(*north)
    if done.returncode or not shown["sessions"] or shown["clients"] or "does not permit" not in done.stderr:
        raise Failed(f"a site is shown the clients of others: {done.stderr} {shown}")
    done, shown = top(f"nats://127.0.0.1:{nobody}")
    if done.returncode != 1 or "cannot be reached" not in done.stderr:
        raise Failed(f"top does not say why it shows nothing: {done.stderr}")


def locked(stage):
    """TLS and files of NATS users (.creds): relays with both pass the session on; without one of them they say why not, and tell nobody a password."""
    ca, cert, key = credentials.certificates(stage.folder)
    operator = credentials.Operator(stage.folder)
    server = operator.user("server", ["tandem.*.beat", "tandem.*.delta.>", "tandem.*.inputs", "tandem.*.status", "tandem.*.clients", "tandem.*.to.>"],
                           ["tandem.*.from.>", "tandem.*.hello", "tandem.*.beat"])  # fmt: skip
    north = operator.user("north", ["tandem.*.from.north.>", "tandem.*.hello"],
                          ["tandem.*.beat", "tandem.*.delta.>", "tandem.*.inputs", "tandem.*.status", "tandem.*.to.north.>"])  # fmt: skip
    (port,) = nats.free_ports(1)
    file = stage.folder / "locked.conf"
    file.write_text(f'listen: "127.0.0.1:{port}"\ntls {{ cert_file: "{cert}", key_file: "{key}" }}\n{operator.configuration}', encoding="ascii")
    with nats.plain(file, port):
        url, folder = f"tls://127.0.0.1:{port}", stage.folder / "live"
        stage.server("server")
        stage.start("near", stage.options.relay, "--from", "dds", "--to", url, "--to-ca", ca, "--to-credentials", server, "--site", "server")
        with stage.elsewhere():
            stage.start("far", stage.options.relay, "--from", url, "--from-ca", ca, "--from-credentials", north, "--site", "north", "--to", "http", folder)
        stage.wait(lambda: (folder / "manifest.json").exists() and len(folders.hashes(folder)) >= 90, "90 frames over TLS")
        good = {"--nats": url, "--nats-ca": ca, "--nats-credentials": north, "--site": "north", "--session": "default"}
        for what, change, words in (
            ("a good user", {}, '"ok":true'),
            ("no authority", {"--nats-ca": None}, "certificate"),
            ("no user", {"--nats-credentials": None}, "uthoriz"),
            ("another host's certificate", {"--nats": f"tls://localhost:{port}"}, "hostname mismatch"),
        ):
            flags = [word for flag, value in {**good, **change}.items() if value for word in (flag, value)]
            done = subprocess.run([stage.options.tandem, "doctor", "--json", *flags], capture_output=True, text=True, timeout=40, check=False)
            if done.returncode != (1 if change else 0) or words not in done.stdout:
                raise Failed(f"{what}: {done.stdout}")
        stage.processes["far"].terminate()
        stage.processes["far"].wait(20)
        stage.stop("server")
    compare_maps(stage.hashes("server"), folders.hashes(folder), 90)


def slow(stage):
    """A NATS server with small limits cuts a site that does not read: it asks for what it missed, its client joins nothing anew, and all of that is said."""
    (port,) = nats.free_ports(1)
    file, log = stage.folder / "small.conf", stage.folder / "small.log"
    file.write_text(f'listen: "127.0.0.1:{port}"\nlog_file: "{log}"\nmax_payload: 4KB\nmax_pending: 1MB\nwrite_deadline: "300ms"\n', encoding="ascii")
    with nats.plain(file, port):
        stage.server("server")
        stage.start("near", stage.options.relay, "--from", "dds", "--to", f"nats://127.0.0.1:{port}", "--site", "server", "--metrics", stage.metrics_port)
        stage.gateway("gateway", "--from", f"nats://127.0.0.1:{port}", "--site", "south")
        with stage.far():
            stage.start("far", stage.options.relay, "--from", f"nats://127.0.0.1:{port}", "--to", "dds", "--site", "north", "--metrics", stage.far_metrics_port)
            stage.client("watches", "--observe")
        with stage.elsewhere():
            stage.start("web", stage.options.tandem, "join", "--json", "--live", "--hash-log", stage.log("web"), "--url", f"ws://127.0.0.1:{stage.port}/")
        stage.plays("watches")
        stage.plays("web")
        listens = nats.Client(port)
        listens.subscribe("tandem.default.from.north.>")
        listens.read(lambda: listens.messages, 10)
        site = listens.messages[0][0].rsplit(".", 1)[1]
        stage.processes["far"].send_signal(signal.SIGSTOP)
        noise = nats.Client(port)
        noise.socket.settimeout(20)
        end = time.monotonic() + 20  # frames are kept for 30 s
        while "Slow Consumer" not in log.read_text() and time.monotonic() < end:
            for _ in range(20):  # what the site would have to read
                noise.publish(f"tandem.default.to.north.{site}", bytes(4000))
        if "Slow Consumer" not in log.read_text():
            raise Failed("the NATS server does not cut a site that does not read")
        stage.plays("web", 30)  # the others notice nothing
        stage.processes["far"].send_signal(signal.SIGCONT)
        repaired = time.monotonic()
        stage.plays("watches", 200)
        print(f"  200 frames {time.monotonic() - repaired:.1f} s after the site read again")
        far, near = stage.page(stage.far_metrics_port), stage.page(stage.metrics_port)
        reports = {name: stage.stop(name) for name in ("watches", "web")}
        stage.stop("server")
    for name, report in reports.items():
        check_report(report)
        if report["resyncs"]:
            raise Failed(f"{name} joined anew: {report}")
        compare(stage, ["server"], name, 200)

    def count(page, name):
        return sum(float(line.split()[-1]) for line in page.splitlines() if line.startswith((name + " ", name + "{")))

    if count(far, "tandem_relay_asked_total") <= 0 or count(near, "tandem_relay_repeated_bytes_total") <= 0:
        raise Failed("what was asked for and sent again is not counted")
    if count(far, "tandem_relay_connections_lost_total") != 1 or not stage.says("far", "was lost, and is made anew"):
        raise Failed("the relay does not say that it was cut")


def compare_maps(server, found, least):
    """Every frame of the folder has the server's hash; a server that was killed may not have written its last ones."""
    last = {}
    for epoch, frame in server:
        last[epoch] = max(frame, last.get(epoch, 0))
    compared = {key: value for key, value in found.items() if key[1] <= last.get(key[0], 0)}
    wrong = [key for key, value in compared.items() if server.get(key) != value]
    if wrong or len(compared) < least:
        raise Failed(f"{len(wrong)} of {len(compared)} frames differ, from {wrong[:1]}")
    print(f"  {len(compared)} frames in the folder, each with the server's hash")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", choices=["sites", "strangers", "audience", "operators", "locked", "standby", "slow", "restarts", "edges"])
    for program in ("tandemd", "tandem", "relay", "gateway", "viewer"):
        parser.add_argument(f"--{program}", required=True, type=pathlib.Path)
    options = parser.parse_args()
    if nats.program() is None:
        print("skipped: nats-server (Debian package nats-server) is not installed")
        return SKIPPED
    try:
        with tempfile.TemporaryDirectory() as folder, Sites(options, folder) as stage:
            globals()[options.scenario](stage)
    except Failed as failed:
        print(f"FAILED {options.scenario}: {failed}", file=sys.stderr)
        return 1
    print(f"passed {options.scenario}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
