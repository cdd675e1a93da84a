"""An engine of IMD, written from the text of version 3 (Becksteinlab/imdclient, docs/source/protocol_v3.rst)."""

import socket
import struct

import numpy as np

DISCONNECT, COORDINATES, GO, HANDSHAKE, FORCES_IN, INFO, TIME, BOX, VELOCITIES = 0, 2, 3, 4, 6, 10, 12, 13, 14
LIMIT_S = 60


def head(kind, value):
    return struct.pack(">ii", kind, value)


def receive(connection, count):
    data = b""
    while len(data) < count:
        got = connection.recv(count - len(data))
        if not got:
            raise EOFError
        data += got
    return data


class Engine:
    """Listens on a port of loopback; a test plays the simulation."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(LIMIT_S)
        self.port = self.listener.getsockname()[1]

    def accept(self, version, order="<"):
        self.order = order
        self.connection, _ = self.listener.accept()
        self.connection.settimeout(LIMIT_S)
        self.connection.sendall(struct.pack(">i", HANDSHAKE) + struct.pack(order + "i", version))
        if version == 3:
            self.connection.sendall(head(INFO, 7) + bytes([1, 0, 1, 1, 0, 1, 0]))
        assert receive(self.connection, 8)[:4] == head(GO, 0)[:4]
        return self

    def send(self, positions, velocities=None, step=0, dt=0.5, box=10):
        out = b""
        if velocities is not None:
            out += head(TIME, 1) + struct.pack(self.order + "ddq", dt, dt * step, step)
            out += head(BOX, 1) + struct.pack(self.order + "9f", box, 0, 0, 0, box, 0, 0, 0, box)
        out += head(COORDINATES, len(positions)) + np.asarray(positions, self.order + "f4").tobytes()
        if velocities is not None:
            out += head(VELOCITIES, len(positions)) + np.asarray(velocities, self.order + "f4").tobytes()
        self.connection.sendall(out)

    def forces(self):
        """Waits for forces: {atom: (x, y, z)}."""
        while True:
            kind, count = struct.unpack(">ii", receive(self.connection, 8))
            if kind != FORCES_IN:
                continue
            atoms = struct.unpack(f"{self.order}{count}i", receive(self.connection, 4 * count))
            values = np.frombuffer(receive(self.connection, 12 * count), self.order + "f4").reshape(count, 3)
            return {atom: tuple(map(float, value)) for atom, value in zip(atoms, values)}

    def close(self):
        for each in (getattr(self, "connection", None), self.listener):
            if each:
                each.close()
