"""Faults of a link that are really made, in networks of the test's own, and the alerts that they fire."""

import os
import pathlib
import sys
import time

FAULT = pathlib.Path(__file__).resolve().parents[2] / "fault"
sys.path += [str(FAULT), str(FAULT / "links")]
from relay import Network  # noqa: E402
from stage import NOT_RUN, SEED, URI, enter_namespace  # noqa: E402

from faults import of  # noqa: E402
from programs import Prometheus, wait_for  # noqa: E402

CLIENTS = ("far", "near", "other")
CUT_S = 35  # longer than the server keeps deltas


def lose_packets(network, prometheus):
    print(f"seed {SEED}", flush=True)
    network.set("far", "down", loss=0.3)
    prometheus.wait_for_alert("TandemLinkLoss")
    network.set("far", loss=0)
    prometheus.wait_for_silence()


def cut_all(network, prometheus, server):
    """For so long that each client has to join again."""
    network.set_all(dead=True)
    time.sleep(CUT_S)
    network.set_all(dead=False)
    wait_for(lambda: of(server, "tandem_rejoins_total") >= len(CLIENTS), "rejoins")
    prometheus.wait_for_alert("TandemRejoins")


def run(stage):
    if not enter_namespace() or not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        print("not run: network namespaces or TAP devices are not allowed here")
        return NOT_RUN
    with Network(*CLIENTS, seed=SEED) as network, network.server.entered():
        stage.uri = URI.format(network.server.interface)
        server = stage.server(2000, "--predictor", "ballistic")
        for name in CLIENTS:
            with network.clients[name].entered():
                stage.start(name, stage.options.tandem, "join")
        wait_for(lambda: of(server, 'tandem_clients{delay="0",stream="0",role="participant"}') == len(CLIENTS), "participants")
        prometheus = Prometheus(stage, {"tandemd": server})
        wait_for(lambda: prometheus.query("rate(tandem_repeated_bytes_total[10s])"), "ten seconds without a fault")
        prometheus.wait_for_silence()
        lose_packets(network, prometheus)
        cut_all(network, prometheus, server)
        # Its devices end before the relay that carries their frames.
        stage.end()
    return 0
