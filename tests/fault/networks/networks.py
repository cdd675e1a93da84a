#!/usr/bin/env python3
"""Sessions on networks of all kinds, with the profiles of deploy/dds: switches, routers, NAT, narrow and lossy links.

networks.py --tandemd PATH --tandem PATH [--gateway PATH] [--list | --short | CASE ...]

Machines are network namespaces of this test's own. Without CASE all run, one after the other, in some six minutes; with
--short those that need no relay, four at a time, in about one. Cases with NAT need iptables, and are left out without. Exit 0 passed, 1 failed, 77 not
run: namespaces or virtual interfaces are not allowed here.
"""

import concurrent.futures
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import threading
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "links"))
from relay import Network  # noqa: E402
from routed import attach, cable, has_iptables, machines, router, switch  # noqa: E402
from stage import NOT_RUN, Failed, arguments, environment, run  # noqa: E402

SERVER = "203.0.113"  # networks for documentation, which routers on the Internet do not know; not private ones either
OUTSIDE = "198.51.100"


def check(good, what):
    if not good:
        raise Failed(what)


def plays(client, seconds=20):
    """The client plays. Return after how many seconds it did."""
    return client.wait_for("playing from frame", seconds) - client.started


def becomes_unready(stage, machine, metrics, seconds):
    """The server whose metrics are at that address is not ready within so many seconds."""
    ends = time.monotonic() + seconds
    with machine.entered():
        while subprocess.run([stage.options.tandemd, "--probe", f"{metrics}/readyz"], capture_output=True, check=False).returncode != 1:
            check(time.monotonic() < ends, "a server without its network is ready")
            time.sleep(0.1)


def played_well(client):
    report = client.stop()
    check(report.get("frames_applied", 0) > 0, f"no frame was applied: {report}")
    check(report["hash_mismatches"] == 0 and report["resyncs"] == 0, f"mismatches or rejoins: {report}")
    return report


def doctor(stage, machine, *more, code=0, prepare=None):
    """Return the checks of `tandem doctor` by name. `prepare` is called in its process."""
    with machine.entered():
        done = subprocess.run([stage.options.tandem, "doctor", "--json", *more], capture_output=True, text=True, timeout=60,
                              env=environment(None), check=False, preexec_fn=prepare)  # fmt: skip
    check(done.returncode == code, f"doctor {more} exits with {done.returncode}, not {code}: {done.stdout}{done.stderr}")
    return {check["name"]: check for check in json.loads(done.stdout)["checks"]}


def refused(stage, machine, code, words, *command):
    """The program says one line with these words and ends with that code. Return the line."""
    with machine.entered():
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment(None), check=False)
    lines = [line for line in done.stderr.splitlines() if "--help" not in line and "[info]" not in line]
    check(done.returncode == code and len(lines) == 1, f"{command}: exit {done.returncode}, {done.stderr}{done.stdout}")
    for word in words:
        check(word in lines[0], f"'{word}' is not in: {lines[0]}")
    return lines[0]


def server(stage, machine, *more, bodies=500):
    return stage.server(bodies, *more, namespace=machine)


def client(stage, machine, profile, *more):
    return stage.client("--profile", profile, *more, namespace=machine)


def lan(stage):
    """A switch that passes multicast: everybody finds everybody."""
    with machines(3) as (one, two, three):
        switch((one, "eth0", "10.1.0.1/24"), (two, "eth0", "10.1.0.2/24"), (three, "eth0", "10.1.0.3/24"))
        server(stage, one, "--profile", "lan")
        clients = [client(stage, two, "lan"), client(stage, three, "lan:interface=eth0", "--observe")]
        print("  playing after " + ", ".join(f"{plays(each):.2f} s" for each in clients))
        checks = doctor(stage, three, "--profile", "lan")
        check("tandemd default at 10.1.0.1" in checks["peers"]["detail"], f"the server is not heard: {checks['peers']}")
        check(checks["peers"]["detail"].count("tandem client") == 2, f"not both clients are heard: {checks['peers']}")
        for each in clients:
            played_well(each)


def wan(stage):
    """Three networks, a router without multicast between them: clients find the server, and not each other."""
    with machines(3) as (one, two, three):
        router((one, "eth0", SERVER, 1500), (two, "eth0", OUTSIDE, 1500), (three, "eth0", "192.0.2", 1500))
        server(stage, one, "--profile", "wan")
        lost = stage.client("--timeout", 4, namespace=two)  # no profile: multicast, which the router does not pass
        profile = f"wan:server={SERVER}.2"
        clients = [client(stage, two, profile), client(stage, three, profile, "--observe")]
        print("  playing after " + ", ".join(f"{plays(each):.2f} s" for each in clients))
        for machine in (two, three):
            heard = doctor(stage, machine, "--profile", profile)["peers"]["detail"]
            check(heard == f"tandemd default at {SERVER}.2", f"heard, besides the server or instead: {heard}")
        recording = pathlib.Path(stage.folder) / "wan.mcap"
        recorder = stage.start(stage.options.tandem, "record", recording, "--profile", profile, "--seconds", 2, "--json",
                               namespace=two)  # fmt: skip
        check(recorder.output(30).get("frames_recorded", 0) > 30, f"the recorder recorded nothing: {recorder.lines}")
        top = stage.start(stage.options.tandem, "top", "--once", "--json", "--profile", profile, namespace=three)
        check(len(top.output(30)["sessions"]) == 1, "top does not see the session")
        if stage.options.gateway:
            stage.start(stage.options.gateway, "--port", 0, "--profile", profile,
                        namespace=two).wait_for("playing from frame", 20)  # fmt: skip
        for each in clients:
            played_well(each)
        lost.process.wait(10)
        check(not lost.first("playing from frame"), "a client without a profile plays through a router: the test is wrong")


def standby(stage):
    """A second server in another network follows the first, and takes over from it."""
    with machines(3) as (one, two, three):
        router((one, "eth0", SERVER, 1500), (two, "eth0", OUTSIDE, 1500), (three, "eth0", "192.0.2", 1500))
        live = server(stage, one, "--profile", "wan")
        second = stage.start(stage.options.tandemd, "--scene", "half_pipe", "--bodies", 500, "--seed", 1, "--standby", "--json",
                             "--profile", f"wan:server={SERVER}.2", namespace=two)  # fmt: skip
        second.wait_for("follows", 30)
        player = client(stage, three, f"wan:server={SERVER}.2,server={OUTSIDE}.2")
        plays(player)
        time.sleep(2)
        live.process.send_signal(signal.SIGKILL)
        killed = time.monotonic()
        second.wait_for("takes over", 20, killed)
        back = player.wait_for("playing from frame", 20, killed) - killed
        print(f"  playing again {back:.1f} s after kill -9")
        report = player.stop()
        check(report["hash_mismatches"] == 0, f"mismatches: {report}")


def mtu(stage):
    """A path of 1,280 bytes where fragments and the routers' complaints are lost: no packet of the profile is too large."""
    with machines(2) as (one, two):
        middle = router((one, "eth0", SERVER, 1500), (two, "eth0", OUTSIDE, 1280))
        if has_iptables(middle):
            middle.run("iptables", "-A", "OUTPUT", "-p", "icmp", "-j", "DROP")
            middle.run("iptables", "-A", "FORWARD", "-f", "-j", "DROP")
        server(stage, one, "--profile", "wan", bodies=10_000)
        player = client(stage, two, f"wan:server={SERVER}.2")
        print(f"  playing after {plays(player):.2f} s")
        time.sleep(2)
        played_well(player)
        for machine in (one, middle, two):
            check(machine.fragments() == (0, 0), f"packets were cut up: {machine.fragments()}")
        found = doctor(stage, two, "--profile", f"wan:server={SERVER}.2")["MTU"]
        check(found["verdict"] == "ok" and "1280" in found["detail"], f"doctor says {found}")


def nat(stage):
    """Two clients behind one router that translates addresses: they play when they say which address others see."""
    with machines(3) as (one, two, three):
        middle = router((one, "eth0", SERVER, 1500), (two, "eth0", "192.168.1", 1500), (three, "eth0", "192.168.2", 1500))
        if not has_iptables(middle):
            print("  left out: iptables is not here, or not allowed")
            return
        middle.run("iptables", "-t", "nat", "-A", "POSTROUTING", "-o", "port0", "-j", "MASQUERADE")
        # As an access router does: nothing comes in that is no answer.
        middle.run("iptables", "-A", "FORWARD", "-i", "port0", "-m", "conntrack", "--ctstate", "ESTABLISHED", "-j", "ACCEPT")
        middle.run("iptables", "-A", "FORWARD", "-i", "port0", "-j", "DROP")
        one.run("ip", "route", "del", "default")  # a server on the Internet has no route to private addresses
        serving = server(stage, one, "--profile", "wan")
        known = f"wan:server={SERVER}.2,external={SERVER}.1"
        clients = [client(stage, two, known), client(stage, three, known)]
        print("  playing after " + ", ".join(f"{plays(each):.2f} s" for each in clients))
        masked = client(stage, three, f"wan:server={SERVER}.2", "--timeout", 3)
        line = masked.wait_for("if NAT is between", 5) and [text for _, text in masked.lines if "NAT" in text][0]
        print(f"  {line}")
        peers = doctor(stage, two, "--profile", f"wan:server={SERVER}.2", code=1)["peers"]
        check("NAT is between" in peers["detail"] and "external=ADDRESS" in peers["advice"], f"doctor says {peers}")
        check(doctor(stage, two, "--profile", known)["peers"]["verdict"] == "ok", "doctor finds fault with a good profile")
        masked.process.wait(20)
        check(not masked.first("playing from frame"), "a client without its address plays: the test is wrong")
        for each in clients:
            played_well(each)
        lines = [text for _, text in serving.lines if "behind NAT" in text]
        check(1 <= len(lines) <= 2, f"the server says {len(lines)} times that clients cannot be reached: {lines}")
        check("retcode" not in "".join(text for _, text in serving.lines), "Cyclone DDS fills the log")


def forwarded(stage):
    """A server behind a router that passes its port on, as a host in a cloud or at home: it says which address others see."""
    with machines(2) as (one, two):
        middle = router((one, "eth0", "192.168.1", 1500), (two, "eth0", OUTSIDE, 1500))
        if not has_iptables(middle):
            print("  left out: iptables is not here, or not allowed")
            return
        middle.run("iptables", "-t", "nat", "-A", "POSTROUTING", "-o", "port1", "-j", "MASQUERADE")
        middle.run("iptables", "-t", "nat", "-A", "PREROUTING", "-i", "port1", "-p", "udp", "--dport", "7410",
                   "-j", "DNAT", "--to-destination", "192.168.1.2")  # fmt: skip
        two.run("ip", "route", "del", "default")  # knows the outside alone
        server(stage, one, "--profile", f"wan:external={OUTSIDE}.1")
        player = client(stage, two, f"wan:server={OUTSIDE}.1")
        print(f"  playing after {plays(player):.2f} s")
        played_well(player)


def choice(stage):
    """A machine on two networks of which one is right: nobody guesses."""
    with machines(3) as (one, two, nobody):
        switch((one, "bridge9", "172.17.0.1/16"), (nobody, "eth0", "172.17.0.2/16"))
        switch((one, "eth1", "10.1.0.1/24"), (two, "eth0", "10.1.0.2/24"))
        tandemd = [stage.options.tandemd, "--scene", "cube", "--bodies", 5, "--duration", 1]
        refused(stage, one, 1, ("several networks", "bridge9 172.17.0.1", "eth1 10.1.0.1", "lan:interface="),
                *map(str, tandemd), "--profile", "lan")  # fmt: skip
        found = doctor(stage, one)["interfaces"]
        check(found["verdict"] == "warning" and "--profile lan:interface=" in found["advice"], f"doctor says {found}")
        server(stage, one, "--profile", "lan:interface=eth1")
        player = client(stage, two, "lan")
        print(f"  playing after {plays(player):.2f} s")
        # The route to the server decides, also where another network comes first.
        cable(two, "aaa0", nobody, "bbb0")
        attach(two, "aaa0", "172.18.0.2/16")
        played_well(player)
        named = client(stage, two, "wan:server=10.1.0.1", "--timeout", 2)
        named.wait_for("profile wan on eth0", 5)


def multihomed(stage):
    """A server on two networks, with a client on each."""
    with machines(3) as (one, two, three):
        switch((one, "eth0", "10.1.0.1/24"), (two, "eth0", "10.1.0.2/24"))
        switch((one, "eth1", "10.2.0.1/24"), (three, "eth0", "10.2.0.2/24"))
        server(stage, one, "--profile", "multihomed:interface=eth0,interface=eth1")
        clients = [client(stage, two, "lan"), client(stage, three, "lan")]
        print("  playing after " + ", ".join(f"{plays(each):.2f} s" for each in clients))
        time.sleep(2)
        for each in clients:
            played_well(each)


def together(stage):
    """Server and client on one machine, with each profile; and with a client on another one on the same two networks."""
    both = "multihomed:interface=eth0,interface=eth1"
    for for_server, for_client in (("lan", "lan"), ("wifi", "wifi"), ("wan", "wan:server=10.1.0.1"), (both, both), ("loopback",) * 2):
        with machines(2) as (one, two):
            switch((one, "eth0", "10.1.0.1/24"), (two, "eth0", "10.1.0.2/24"))
            clients = []
            if for_server == both:
                switch((one, "eth1", "10.2.0.1/24"), (two, "eth1", "10.2.0.2/24"))
                clients.append(client(stage, two, both))
            server(stage, one, "--profile", for_server)
            clients.append(client(stage, one, for_client))
            for each in clients:
                plays(each)
            for each in clients:
                played_well(each)
            stage.end_all()


def bad_input(stage):
    """What is wrong with a profile is one line, and nobody gets in."""
    with machines(2) as (one, two):
        router((one, "eth0", SERVER, 1500), (two, "eth0", OUTSIDE, 1500))
        tandemd = [str(stage.options.tandemd), "--scene", "cube", "--bodies", "5", "--profile"]
        join = [str(stage.options.tandem), "join", "--timeout", "1", "--profile"]
        gateway = [str(stage.options.gateway), "--port", "0", "--profile"]
        known = ("loopback, lan, wifi, wan or multihomed", "'moon'")
        for program in (tandemd, join, gateway) if stage.options.gateway else (tandemd, join):
            refused(stage, one, 2, known, *program, "moon")
            refused(stage, one, 2, ("lan takes interface", "'server'"), *program, "lan:server=10.0.0.1")
            refused(stage, one, 2, ("KEY=VALUE", "'eth0'"), *program, "lan:eth0")
            refused(stage, one, 2, ("two to four interfaces",), *program, "multihomed:interface=eth0")
            refused(stage, one, 1, ("no interface 'eth9'", f"eth0 {SERVER}.2"), *program, "lan:interface=eth9")
        refused(stage, one, 2, ("needs the server's address: wan:server=ADDRESS",), *join, "wan")
        refused(stage, one, 1, ("'no.such.host.invalid'", "cannot be looked up"), *join, "wan:server=no.such.host.invalid")
        refused(stage, one, 1, ("is this machine",), *join, "wan:server=127.0.0.1")
        one.run("ip", "link", "set", "eth0", "down")
        refused(stage, one, 1, ("'eth0' is down", "ip link set eth0 up"), *join, "lan:interface=eth0")
        refused(stage, one, 1, (f"no route to the server {OUTSIDE}.2",), *join, f"wan:server={OUTSIDE}.2")
        one.run("ip", "link", "set", "eth0", "up")
        stage.start(*tandemd, "wan", namespace=one).wait_for("session 'default'", 20)
        refused(stage, one, 1, ("UDP port 7410 is in use", "wan:index=N"), *tandemd, "wan", "--session", "two")
        second = stage.start(*tandemd, "wan:index=1", "--session", "two", namespace=one)
        second.wait_for("UDP port 7412", 20)
        checks = doctor(stage, one, "--profile", "wan", code=1)
        check(checks["ports"]["verdict"] == "failure" and "7410" in checks["ports"]["detail"], f"doctor says {checks['ports']}")


def doctor_finds(stage):
    """What the doctor says of networks with a fault each."""
    with machines(2) as (one, two):
        middle = router((one, "eth0", SERVER, 1500), (two, "eth0", OUTSIDE, 1500))
        profile = ("--profile", f"wan:server={SERVER}.2")
        peers = doctor(stage, two, *profile, code=1)["peers"]
        check("nothing listens" in peers["detail"] and "start the server" in peers["advice"], f"no server: {peers}")
        for machine, interface in ((middle, "port0"), (one, "eth0")):
            machine.run("ip", "link", "set", interface, "mtu", "1200")
        narrow = doctor(stage, two, *profile, code=1)["MTU"]
        check(f"to {SERVER}.2:7410 1200" in narrow["detail"] and narrow["verdict"] == "warning" and "1260" in narrow["advice"],
              f"MTU 1200 on the way: {narrow}")  # fmt: skip
        two.run("ip", "link", "set", "eth0", "mtu", "1400")
        narrow = doctor(stage, two, "--profile", "lan")["MTU"]
        check(narrow["verdict"] == "warning" and "--profile wan" in narrow["advice"], f"MTU 1400, lan: {narrow}")
        two.run("ip", "link", "set", "eth0", "multicast", "off")
        deaf = doctor(stage, two)["multicast"]
        check(deaf["verdict"] == "warning" and "--profile wan" in deaf["advice"], f"no multicast: {deaf}")
        gone = doctor(stage, two, "--profile", "lan:interface=eth9", code=1)["profile"]
        check(gone["verdict"] == "failure" and "no interface 'eth9'" in gone["detail"], f"no interface: {gone}")
        few = doctor(stage, one, prepare=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (100, 100)))["open files"]
        check(few["verdict"] == "warning" and "ulimit -n" in few["advice"], f"few open files: {few}")
        ports = doctor(stage, one, "--domain", "120")["ports"]
        check(ports["verdict"] == "warning" and "0 to 100" in ports["advice"], f"ephemeral ports: {ports}")
        with one.entered():
            held = subprocess.Popen([sys.executable, "-c", "import socket,sys; s=socket.socket(type=socket.SOCK_DGRAM);"
                                     "s.bind(('',7400)); print(flush=True); sys.stdin.read()"], stdin=subprocess.PIPE,
                                    stdout=subprocess.PIPE)  # fmt: skip
        held.stdout.readline()
        ports = doctor(stage, one, code=1)["ports"]
        held.communicate()
        check(ports["verdict"] == "failure" and "7400 is in use" in ports["detail"], f"a port in use: {ports}")


def wifi(stage):
    """A radio: 2 % of the packets lost in bursts, and up to 6 ms late."""
    with Network("one", "two", seed=1) as network:
        network.set_all(delay_ms=1, jitter_ms=5, burst_loss=0.02, burst_packets=3)
        for machine in [network.server, *network.clients.values()]:
            machine.interface = None
        server(stage, network.server, "--profile", "wifi", bodies=2000)
        clients = [client(stage, machine, "wifi") for machine in network.clients.values()]
        print("  playing after " + ", ".join(f"{plays(each):.2f} s" for each in clients))
        time.sleep(8)
        for each in clients:
            latency = played_well(each)["latency_ms"]
            print(f"  latency p50 {latency['p50']:.1f} ms, p99 {latency['p99']:.1f} ms")


def moved(stage):
    """What DDS is bound to changes: a network that comes after the server, a client's address, the server's device."""
    def connect(*addresses):
        cable(one, "eth0", two, "eth0")
        for machine, address in zip((one, two), addresses):
            attach(machine, "eth0", address)

    with machines(2) as (one, two):
        serving = stage.start(stage.options.tandemd, "--scene", "half_pipe", "--bodies", 500, "--metrics", 9730, namespace=one)
        serving.wait_for("there is no network yet", 20)
        connect("10.1.0.1/24", "10.1.0.2/24")
        serving.wait_for("there is a network now (eth0 10.1.0.1)", 20)
        player, lost = client(stage, two, "lan"), client(stage, two, "lan")
        plays(player)
        plays(lost)

        changed = time.monotonic()
        two.run("ip", "address", "flush", "dev", "eth0", "scope", "global")
        player.wait_for("is gone from this machine", 10, changed)
        player.wait_for("no frame came for", 10, changed)
        time.sleep(3)
        lost.stop()
        check(lost.process.returncode == 1, "a client whose last frames never came ends with 0")
        attach(two, "eth0", "10.1.0.3/24")
        player.wait_for("playing from frame", 20, player.wait_for("joined the network anew", 20, changed))

        one.run("ip", "link", "del", "eth0")  # both ends of the cable
        serving.wait_for("nobody can join", 20)
        becomes_unready(stage, one, "127.0.0.1:9730", seconds=5)  # it looks once a second
        removed = time.monotonic()
        connect("10.1.0.1/24", "10.1.0.3/24")
        serving.wait_for("it has eth0 10.1.0.1 now", 20, removed)
        player.wait_for("playing from frame", 30, removed)
        report = player.stop()
        check(report["hash_mismatches"] == 0 and player.process.returncode == 0, f"it ends badly: {report}, {player.lines[-3:]}")
        check(serving.process.poll() is None, f"the server has ended: {serving.lines[-3:]}")


def ipv6(stage):
    """No network has an IPv4 address: without a profile, with one, and through a router that passes no multicast."""
    with machines(2) as (one, two):
        cable(one, "eth0", two, "eth0")
        try:
            for machine, address in ((one, "fd77::1/64"), (two, "fd77::2/64")):
                machine.run("ip", "address", "add", address, "dev", "eth0", "nodad")
        except subprocess.CalledProcessError:
            print("  left out: IPv6 is not allowed here")
            return
        for its, others in ((), ()), (("--profile", "lan"),) * 2, (("--profile", "wan"), ("--profile", "wan:server=[fd77::1]")):
            serving = server(stage, one, *its)
            player = stage.client(*others, namespace=two)
            plays(player)
            checks = doctor(stage, two, *others)
            check("tandemd default at fd77::1" in checks["peers"]["detail"], f"the server is not heard: {checks['peers']}")
            check("eth0" in checks["interfaces"]["detail"], f"the interface is not named: {checks['interfaces']}")
            check(checks["multicast"]["verdict"] == "ok", f"multicast: {checks['multicast']}")
            played_well(player)
            serving.stop()


class FrameTimes:
    """When a client applied each frame: its hash log is a terminal, to which every line is written at once."""

    def __init__(self):
        self.end, terminal = os.openpty()
        self.path = os.ttyname(terminal)
        self.terminal = terminal  # stays open, so that reading does not end before the client begins
        self.frames = []
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        told = b""
        while more := os.read(self.end, 1 << 16):
            *lines, told = (told + more).split(b"\n")
            self.frames += [(time.monotonic(), int(line.split(b",")[1])) for line in lines]


def cut(stage, seconds, profile="wan", to_server=":server=10.78.0.1", limit_s=20):
    """A link of 40 ms there and back, which loses 1 %, is cut for a while. Print when the client is where it would be."""
    with Network("one", seed=1) as network:
        network.set_all(delay_ms=20, loss=0.01)
        more = []
        if profile:
            more = ["--profile", profile]
            for machine in (network.server, network.clients["one"]):
                machine.interface = None
        server(stage, network.server, *more, bodies=2000)
        if profile:
            more[1] += to_server
        times = FrameTimes()
        player = stage.client(*more, "--observe", "--hash-log", times.path, namespace=network.clients["one"])
        plays(player)
        time.sleep(3)
        network.set_all(dead=True)
        time.sleep(seconds)
        at, last = times.frames[-1]
        network.set_all(dead=False)
        returned = time.monotonic()
        caught_up = None
        while caught_up is None and time.monotonic() - returned < limit_s:
            time.sleep(0.05)
            caught_up = next((now - returned for now, frame in times.frames if now > returned and frame >= last + 30 * (now - at) - 10),
                             None)  # fmt: skip
        first = next((now - returned for now, frame in times.frames if now > returned), None)
        report = player.stop()
        check(first is not None and caught_up is not None, f"not caught up {limit_s} s after the link's return: {player.lines[-3:]}")
        check(report["hash_mismatches"] == 0, f"mismatches: {report}")
        print(f"  {seconds} s without a link, {profile or 'no profile'}: {first:.2f} s after its return the next frame, "
              f"{caught_up:.2f} s caught up; {report['resyncs']} rejoins")  # fmt: skip


def cut_wan(stage):
    """A client goes on after 30 s without a link."""
    cut(stage, 30)


def cut_beyond_the_lease(stage):
    """Longer than DDS remembers the other side: it has to be found again."""
    cut(stage, 60)


def measure_cuts(stage):
    """Four cuts each, with and without the profile."""
    for profile in ("", "wan"):
        for seconds in (30, 60):
            for _ in range(2):
                cut(stage, seconds, profile, limit_s=60)
                stage.end_all()


def measure_profiles(stage):
    """Latency of two clients over a radio and over a long way, with and without a profile."""
    radio = {"delay_ms": 1, "jitter_ms": 5, "burst_loss": 0.02, "burst_packets": 3}
    far = {"delay_ms": 20, "jitter_ms": 4, "loss": 0.02}
    for name, link, profiles in (("radio", radio, ("", "lan", "wifi")), ("far", far, ("", "wan"))):
        for profile in profiles * 3:
            with Network("one", "two", seed=1) as network:
                network.set_all(**link)
                more = ["--profile", profile] if profile else []
                if profile:
                    for machine in [network.server, *network.clients.values()]:
                        machine.interface = None
                server(stage, network.server, *more, "--scripted", bodies=10_000)
                if profile == "wan":
                    more = ["--profile", "wan:server=10.78.0.1"]
                clients = [stage.client(*more, "--observe", namespace=machine) for machine in network.clients.values()]
                joined = max(plays(each) for each in clients)
                time.sleep(10)
                reports = [each.stop() for each in clients]
                stage.end_all()
                p50, p99 = (max(report["latency_ms"][part] for report in reports) for part in ("p50", "p99"))
                print(f"  {name}, {profile or 'no profile'}: playing after {joined:.2f} s, latency p50 {p50:.1f} ms, p99 {p99:.1f} ms, "
                      f"{reports[0]['mbit_per_s']:.2f} Mbit/s, {sum(report['resyncs'] for report in reports)} rejoins", flush=True)  # fmt: skip


def measure_datagrams(stage):
    """Latency of two clients on a switch and the server's processor time, by profile, with deltas of 240 KB."""
    for profile in ("", "lan", "wifi", "wan") * 3:
        with machines(3) as (one, two, three):
            switch((one, "eth0", "10.1.0.1/24"), (two, "eth0", "10.1.0.2/24"), (three, "eth0", "10.1.0.3/24"))
            more = ["--profile", profile] if profile else []
            serving = server(stage, one, *more, "--scripted", "--codec", "none", "--predictor", "ballistic", bodies=10_000)
            if profile == "wan":
                more = ["--profile", "wan:server=10.1.0.1"]
            clients = [stage.client(*more, "--observe", namespace=machine) for machine in (two, three)]
            for each in clients:
                plays(each)
            before = serving.cpu_seconds()
            time.sleep(8)
            busy = (serving.cpu_seconds() - before) / 8
            reports = [each.stop() for each in clients]
            stage.end_all()
            p50, p99 = (max(report["latency_ms"][part] for report in reports) for part in ("p50", "p99"))
            print(f"  {profile or 'no profile'}: latency p50 {p50:.1f} ms, p99 {p99:.1f} ms, {reports[0]['mbit_per_s']:.0f} Mbit/s, "
                  f"server {busy:.0%} of a core, {sum(report['resyncs'] for report in reports)} rejoins", flush=True)  # fmt: skip


# The longest first.
SHORT = {"moved": moved, "together": together, "doctor_finds": doctor_finds, "ipv6": ipv6, "bad_input": bad_input, "wan": wan,
         "nat": nat, "standby": standby, "mtu": mtu, "choice": choice, "multihomed": multihomed, "lan": lan, "forwarded": forwarded}  # fmt: skip
CASES = {**SHORT, "wifi": wifi, "cut_wan": cut_wan, "cut_beyond_the_lease": cut_beyond_the_lease}
MEASUREMENTS = {"measure_cuts": measure_cuts, "measure_profiles": measure_profiles, "measure_datagrams": measure_datagrams}


def side_by_side(cases):
    """Run each case by a process of its own, as they mostly wait. Return the exit code."""
    command = [sys.executable, "-B", *(word for word in sys.argv if word != "--short")]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        ran = list(pool.map(lambda case: subprocess.run([*command, case], capture_output=True, text=True, check=False), cases))
    for done in ran:
        print(done.stdout + done.stderr, end="", flush=True)
    codes = {done.returncode for done in ran}
    return next((code for code in codes if code not in (0, NOT_RUN)), NOT_RUN if NOT_RUN in codes else 0)


def main():
    parser = arguments(__doc__, "the cases that need no relay")
    parser.add_argument("--gateway", type=pathlib.Path)
    options = parser.parse_args()
    if options.short and not options.list and not options.cases:
        return side_by_side(SHORT)
    try:
        return run({**CASES, **MEASUREMENTS}, options.cases or list(CASES), parser, options)
    except subprocess.CalledProcessError as error:
        print(f"not run: {' '.join(error.cmd)}: {error.stderr.strip()}")
        return NOT_RUN


if __name__ == "__main__":
    sys.exit(main())
