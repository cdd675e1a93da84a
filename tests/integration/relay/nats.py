"""nats-server on loopback for tests, with the configuration of deploy/nats, and a client of the text protocol of NATS."""

import contextlib
import os
import pathlib
import shutil
import socket
import subprocess
import time

CONFIGURATION = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "nats"
PASSWORDS = {"TANDEM_SERVER_PASSWORD": "s", "TANDEM_MONITOR_PASSWORD": "m", "TANDEM_NORTH_PASSWORD": "n", "TANDEM_SOUTH_PASSWORD": "o"}


def program():
    return shutil.which("nats-server") or (shutil.which("/usr/sbin/nats-server"))


def free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


def wait_for_port(port, patience_s=10):
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            time.sleep(0.05)
    raise RuntimeError(f"nothing listens on port {port}")


class Server:
    """One nats-server. `kind` is hub or leaf; a leaf's hub has the URL `hub`."""

    def __init__(self, folder, kind, name, port, leaf_port=0, hub=""):
        self.port, self.process = port, None
        self.folder = pathlib.Path(folder) / name
        shutil.copytree(CONFIGURATION, self.folder, ignore=shutil.ignore_patterns("*.md"))
        self.file = self.folder / f"{kind}.conf"
        text = self.file.read_text()
        text = text.replace('"0.0.0.0:4222"', f'"127.0.0.1:{port}"').replace('"127.0.0.1:4222"', f'"127.0.0.1:{port}"')
        text = text.replace('http: "127.0.0.1:8222"\n', "").replace('"0.0.0.0:7422"', f'"127.0.0.1:{leaf_port}"')
        self.file.write_text(text)
        self.environment = dict(os.environ, TANDEM_NATS_NAME=name, TANDEM_HUB=hub, **PASSWORDS)
        self.start()

    def start(self):
        with open(self.folder / "log", "ab") as log:
            self.process = subprocess.Popen([program(), "--config", str(self.file)], env=self.environment, stdout=log, stderr=log)
        wait_for_port(self.port)

    def kill(self):
        if self.process:
            self.process.kill()
            self.process.wait()
        self.process = None


@contextlib.contextmanager
def plain(configuration, port):
    """A nats-server with a configuration of the test."""
    with subprocess.Popen([program(), "--config", str(configuration)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            wait_for_port(port)
            yield process
        finally:
            process.kill()


class Client:
    """Speaks the text protocol of NATS: just enough to publish, to subscribe, and to hear what is refused."""

    def __init__(self, port, user="", password=""):
        self.socket = socket.create_connection(("127.0.0.1", port), 5)
        self.buffer = b""
        self.errors, self.messages = [], []
        who = f'"user":"{user}","pass":"{password}",' if user else ""
        self.send(f'CONNECT {{{who}"verbose":false,"pedantic":false,"echo":false}}\r\n'.encode())
        self.flush()

    def send(self, data):
        self.socket.sendall(data)

    def subscribe(self, subject, sid=1):
        self.send(f"SUB {subject} {sid}\r\n".encode())
        self.flush()

    def publish(self, subject, payload):
        self.send(f"PUB {subject} {len(payload)}\r\n".encode() + payload + b"\r\n")

    def flush(self, patience_s=5):
        """Waits until the server has answered everything that was sent."""
        self.send(b"PING\r\n")
        self.read(lambda: False, patience_s, until_pong=True)

    def read(self, enough, patience_s, until_pong=False):
        end = time.monotonic() + patience_s
        while not enough():
            line = self._line(end)
            if line is None:
                return
            word = line.split(b" ")[0].upper()
            if word == b"-ERR":
                self.errors.append(line.decode())
            elif word == b"PING":
                self.send(b"PONG\r\n")
            elif word == b"MSG":
                fields = line.split()
                payload = self._bytes(int(fields[-1]) + 2, end)
                if payload is None:
                    return
                self.messages.append((fields[1].decode(), payload[:-2]))
            elif word == b"PONG" and until_pong:
                return

    def _fill(self, end):
        left = end - time.monotonic()
        if left <= 0:
            return False
        self.socket.settimeout(left)
        try:
            data = self.socket.recv(65536)
        except TimeoutError:
            return False
        self.buffer += data
        return bool(data)

    def _line(self, end):
        while b"\r\n" not in self.buffer:
            if not self._fill(end):
                return None
        line, self.buffer = self.buffer.split(b"\r\n", 1)
        return line

    def _bytes(self, count, end):
        while len(self.buffer) < count:
            if not self._fill(end):
                return None
        data, self.buffer = self.buffer[:count], self.buffer[count:]
        return data

    def close(self):
        self.socket.close()
