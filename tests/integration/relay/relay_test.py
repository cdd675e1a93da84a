#!/usr/bin/env python3
"""A session over NATS: tandemd, tandem-relay, nats-server as deploy/nats has it, a relay and a gateway at other sites.

relay_test.py SCENARIO --tandemd PATH --tandem PATH --relay PATH --gateway PATH        Exit 0 passed, 1 failed, 77 skipped.
"""

import argparse
import contextlib
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent), str(pathlib.Path(__file__).resolve().parents[1] / "gateway")]
import audience as folders  # noqa: E402
import nats  # noqa: E402
from gateway_test import Failed, WebStage, check_report, compare  # noqa: E402

SKIPPED = 77


class Sites(WebStage):
    """The server's domain, a hub and the leaf node of site north on loopback, and the domain of that site."""

    def __init__(self, options, folder):
        super().__init__(options, folder)
        self.far_domain = ["--domain", str(int(self.common[1]) + 100)]
        self.hub_port, self.leaf_port, self.north_port, self.metrics_port = nats.free_ports(4)
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

    def relays(self):
        self.start("near", self.options.relay, "--from", "dds", "--to", self.at_hub("server", "s"), "--site", "server", "--metrics", self.metrics_port)
        with self.far():
            self.start("far", self.options.relay, "--from", f"nats://127.0.0.1:{self.north_port}", "--to", "dds", "--site", "north")

    def metric(self, name):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics_port}/metrics", timeout=10) as answer:
            for line in answer.read().decode().splitlines():
                if line.startswith(name + " ") or line.startswith(name + "{"):
                    return float(line.split()[-1])
        raise Failed(f"no metric {name}")

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
    """Who may only watch cannot publish deltas, nor speak for another site, directly or over a leaf node."""
    stage.server("server")
    stage.relays()
    with stage.far():
        stage.client("watches", "--observe")
    stage.plays("watches")
    listens = nats.Client(stage.hub_port, "south", "o")
    listens.subscribe("tandem.default.to.north.>", 1)
    for client in (nats.Client(stage.hub_port, "north", "n"), nats.Client(stage.north_port)):
        for what in ("delta.0", "beat", "inputs", "status", "to.south.0000000000000001", "from.south.0000000000000001"):
            client.publish(f"tandem.default.{what}", b"\x01\x00\x01\x00\x00\x00\x02" + bytes(60))
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
    parser.add_argument("scenario", choices=["sites", "strangers", "audience"])
    for program in ("tandemd", "tandem", "relay", "gateway"):
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
