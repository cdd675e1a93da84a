"""The programs of a test, what their metrics say, and Debian's Prometheus."""

import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request

LIMIT_S = 60  # of any one wait; a busy machine is slow
FIRES_S = 30
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    f"</General><Discovery><Tag>metrics-test-{os.getpid()}</Tag></Discovery></Domain></CycloneDDS>"
)
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
SUPPORT = pathlib.Path(__file__).resolve().parents[2] / "support"
sys.path.insert(0, str(SUPPORT / "hang"))
DEPLOYED = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "metrics"
RULES = ("recording.rules.yml", "alerts.rules.yml")


def get(address, path, timeout=2.0):
    """Status and text; status 0 without an answer."""
    try:
        with urllib.request.urlopen(f"http://{address}{path}", timeout=timeout) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()
    except OSError as error:
        return 0, str(error)


def wait_for(condition, what, limit_s=LIMIT_S):
    """Returns the seconds that it took."""
    began = time.monotonic()
    while not condition():
        assert time.monotonic() - began < limit_s, f"{what}: not within {limit_s} s"
        time.sleep(0.05)
    return time.monotonic() - began


def values(text):
    """Series to its value, from a page."""
    rows = (line.rsplit(" ", 1) for line in text.splitlines() if line and not line.startswith("#"))
    return {series: float(value) for series, value in rows}


class Stage:
    """Programs and their files, ended whatever happens."""

    def __init__(self, options, folder):
        self.options, self.folder, self.processes = options, pathlib.Path(folder), {}
        self.uri = LOOPBACK  # CYCLONEDDS_URI of what starts from now on

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.end()
        if kind is not None:
            for log in sorted(self.folder.glob("*.err")):
                print(f"--- {log.stem}\n{log.read_text(errors='replace')[-2000:]}", file=sys.stderr)

    def end(self):
        for process in self.processes.values():
            if process.poll() is None:
                process.kill()  # also ends what is stopped
                process.wait()

    def start(self, name, *command):
        with open(self.folder / f"{name}.err", "wb") as log:
            self.processes[name] = subprocess.Popen(
                list(map(str, command)), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log,
                env={**ENVIRONMENT, "CYCLONEDDS_URI": self.uri},
            )  # fmt: skip

    def log(self, name):
        return (self.folder / f"{name}.err").read_text(errors="replace")

    def server(self, bodies, *more):
        command = ("--scene", "half_pipe", "--bodies", bodies, "--scripted", "--metrics", 0, *more)
        self.start("server", self.options.tandemd, *command)
        return self.address("server")

    def address(self, name):
        """Where a program that was started with --metrics 0 serves them."""
        pattern = re.compile(r"metrics at http://(\S+)/metrics")
        wait_for(lambda: pattern.search(self.log(name)) or self.processes[name].poll() is not None, f"metrics of {name}")
        found = pattern.search(self.log(name))
        assert found, f"{name}: {self.log(name)}"
        return found.group(1)

    def session(self, *participant):
        """A server, a participant, a gateway and a recorder. Returns the addresses of their metrics by job."""
        places = {"tandemd": self.server(1000, "--stall-timeout", "off", "--checkpoint-dir", self.folder / "checkpoints")}
        self.start("participant", self.options.tandem, "join", *participant)
        self.start("gateway", self.options.gateway, "--port", 0, "--viewer", "", "--metrics", "127.0.0.1:0")
        self.start("recorder", self.options.tandem, "record", self.folder / "session.mcap", "--metrics", "127.0.0.1:0")
        places["tandem-gateway"], places["tandem-recorder"] = self.address("gateway"), self.address("recorder")
        return places

    def signal(self, name, number):
        self.processes[name].send_signal(number)


class Halting:
    """A process that is stopped most of the time, but never for so long that DDS takes it for gone."""

    STOPPED_S, RUNNING_S = 1.2, 0.1

    def __init__(self, process):
        self.process, self.over = process, threading.Event()
        self.thread = threading.Thread(target=self.run)

    def run(self):
        while not self.over.is_set():
            self.process.send_signal(signal.SIGSTOP)
            self.over.wait(self.STOPPED_S)
            self.process.send_signal(signal.SIGCONT)
            self.over.wait(self.RUNNING_S)

    def __enter__(self):
        self.thread.start()

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()


class Prometheus:
    """Debian's, with the deployed configuration on other ports. `hurried`: it looks every second, and rules wait a second at most."""

    def __init__(self, stage, places, hurried=False):
        folder = stage.folder / "prometheus"
        folder.mkdir()
        config = (DEPLOYED / "prometheus.yml").read_text("utf-8")
        for job, default in (("tandemd", 9730), ("tandem-gateway", 9731), ("tandem-recorder", 9732), ("tandem-relay", 9733)):
            target = f'      - targets: ["127.0.0.1:{default}"]'
            assert target in config
            config = config.replace(target, target.replace(f"127.0.0.1:{default}", places[job]) if job in places else "")
        config = re.sub(r"(?m)^    static_configs:\n\n", "    static_configs: []\n", config)
        rules = {name: (DEPLOYED / name).read_text("utf-8") for name in RULES}
        if hurried:
            config = re.sub(r"(?m)^  (\w+_interval|scrape_timeout): .*", r"  \1: 1s", config)
            rules = {name: re.sub(r"(?m)^( +for): .*", r"\1: 1s", text) for name, text in rules.items()}
        (folder / "prometheus.yml").write_text(config, "utf-8")
        for name, text in rules.items():
            (folder / name).write_text(text, "utf-8")
        checked("promtool", "check", "config", folder / "prometheus.yml")
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.address = f"127.0.0.1:{free.getsockname()[1]}"
        stage.start(
            "prometheus", "prometheus", f"--config.file={folder}/prometheus.yml", f"--storage.tsdb.path={folder}/data",
            f"--web.listen-address={self.address}", "--log.level=warn",
        )  # fmt: skip
        wait_for(lambda: get(self.address, "/-/ready")[0] == 200, "Prometheus")

    def ask(self, path, **parameters):
        status, text = get(self.address, f"/api/v1/{path}?{urllib.parse.urlencode(parameters)}", 10)
        assert status == 200, f"{parameters}: {text}"
        return json.loads(text)["data"]

    def query(self, text):
        return self.ask("query", query=text)["result"]

    def firing(self):
        return {alert["labels"]["alertname"] for alert in self.ask("alerts")["alerts"] if alert["state"] == "firing"}

    def wait_for_alert(self, name):
        took_s = wait_for(lambda: name in self.firing(), name, FIRES_S)
        print(f"{name} fires {took_s:.1f} s after its fault", flush=True)

    def wait_for_silence(self):
        wait_for(lambda: not self.firing(), f"no alert any more, but {self.firing()}")


def checked(*command, **more):
    """A promtool that has something to say fails the test."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **more)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout + done.stderr
