"""Machines, switches and routers, as namespaces with cables between them. Nothing of it outlives the test."""

import contextlib
import os
import pathlib
import subprocess
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
from stage import Namespace, shell  # noqa: E402


class Machine(Namespace):
    """A namespace whose programs get no CYCLONEDDS_URI."""

    def __init__(self):
        super().__init__(None)

    def run(self, *words):
        with self.entered():
            shell(*words)

    def write(self, path, text):
        with self.entered():
            pathlib.Path(path).write_text(text)

    def forward(self):
        """Make it a router."""
        self.write("/proc/sys/net/ipv4/ip_forward", "1")

    def fragments(self):
        """Return how many IP packets it cut up, and how many it could not."""
        with self.entered():
            names, values = (line.split() for line in pathlib.Path("/proc/net/snmp").read_text().splitlines()[:2])
        counts = dict(zip(names, values))
        return int(counts["FragCreates"]), int(counts["FragFails"])


def cable(one, its, other, others, mtu=1500):
    """Join two machines by a cable between two interfaces of these names."""
    with one.entered():
        shell("ip", "link", "add", its, "mtu", str(mtu), "type", "veth", "peer", "name", others, "mtu", str(mtu),
              "netns", f"/proc/{os.getpid()}/fd/{other.descriptor}")  # fmt: skip
    for machine, interface in ((one, its), (other, others)):
        machine.run("ip", "link", "set", interface, "up")


def attach(machine, interface, address, gateway=None):
    """Give an interface an address, and perhaps a default route."""
    machine.run("ip", "address", "add", address, "dev", interface)
    if gateway:
        machine.run("ip", "route", "add", "default", "via", gateway)


def switch(*ends, mtu=1500):
    """Join (machine, interface, address) by a switch. Return it."""
    middle = Machine()
    middle.run("ip", "link", "add", "bridge0", "type", "bridge", "mcast_snooping", "0")
    middle.run("ip", "link", "set", "bridge0", "up")
    for number, (machine, interface, address) in enumerate(ends):
        cable(middle, f"port{number}", machine, interface, mtu)
        middle.run("ip", "link", "set", f"port{number}", "master", "bridge0")
        attach(machine, interface, address)
    return middle


def router(*ends):
    """Join (machine, interface, network, mtu) by a router that is .1 in each network, machines being .2. Return it."""
    middle = Machine()
    middle.forward()
    for number, (machine, interface, network, mtu) in enumerate(ends):
        cable(middle, f"port{number}", machine, interface, mtu)
        attach(middle, f"port{number}", f"{network}.1/24")
        attach(machine, interface, f"{network}.2/24", f"{network}.1")
    return middle


def has_iptables(machine):
    """Whether packets can be filtered and translated here."""
    try:
        machine.run("iptables", "-t", "nat", "-L")
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


@contextlib.contextmanager
def machines(count):
    """Machines for a `with`."""
    made = [Machine() for _ in range(count)]
    try:
        yield made
    finally:
        for machine in made:
            machine.end()
