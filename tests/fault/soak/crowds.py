"""Cases of many clients, and of a long time."""

import json
import signal
import time

from clients import Group, top, wait_until
from stage import Failed
from watching import Durations, FRAME, Watch, frame_and_publish_ms, growth_percent, port_of, read_page, total

BUDGET_MS = 33
FRAMES_PER_S = 30
TURN_S = 30  # a twentieth of the crowd leaves and comes in this time
VIEWERS = 50
JOIN_S = 150  # on a machine that all clients share
WARM_S = 600


def start_server(stage, bodies):
    server = stage.serve(bodies, "--scripted", "--metrics", 0)
    return server, port_of(server, "metrics at")


def participants(stage, seconds):
    return [Group(stage, 5, "--input-script", stage.pushes(seconds)) for _ in range(2)]


def observers(stage, count=10):
    return Group(stage, count, "--observe")


def playing(port):
    page = read_page(port)
    return sum(total(page, "tandem_clients", f'role="{role}"') for role in ("participant", "observer"))


def crowd(stage, minutes, rng):
    """10 participants and 190 observers, of whom a tenth leaves and comes each minute."""
    bodies, seconds = 2_000, minutes * 60
    server, port = start_server(stage, bodies)
    groups = participants(stage, seconds + 120)
    for group in groups:
        group.wait(JOIN_S)
    for _ in range(19):
        groups.append(observers(stage))
        groups[-1].wait(JOIN_S)
    wait_until(lambda: playing(port) == 200, 60, "200 clients that play")
    rng.shuffle(groups)
    watch = Watch(server, port, {"server": server})
    wrong, came, began = [], sum(group.count for group in groups), time.monotonic()
    turns = 0
    while began + (turns + 1) * TURN_S < began + seconds:
        time.sleep(max(0, began + (turns + 1) * TURN_S - time.monotonic()))
        old = groups.pop(0)
        wrong += old.stop()
        observes = old.count == 10
        groups.append(observers(stage) if observes else Group(stage, old.count, "--input-script", stage.pushes(seconds)))
        groups[-1].wait(JOIN_S)
        came += old.count
        turns += 1
    time.sleep(max(0, began + seconds - time.monotonic()))
    before, after, took_s = watch.stop()
    processes = len(groups)
    for group in groups:
        wrong += group.stop()
    server.stop()
    if watch.fault:
        raise Failed(watch.fault)
    least_ms, bound_ms = frame_and_publish_ms(before, after)
    rate = Durations(before, after, FRAME).count / took_s
    faults = f": {', '.join(sorted(set(wrong))[:3])}" if wrong else ""
    return [(
        f"10 participants + 190 observers, {bodies:,} bodies, a tenth leaving and joining each minute",
        f"p99 of step + encode + publish below {BUDGET_MS} ms, each client complete",
        f"between {least_ms:.1f} and {bound_ms:.1f} ms, {rate:.2f} frames/s; {came} clients in "
        f"{turns} turns in {took_s / 60:.1f} minutes, {len(wrong)} incomplete{faults}; {processes} processes of 5 or 10 clients, each client with "
        f"a DDS participant of its own; {watch.late} frames above 50 ms, {watch.own} of them not by the scheduler",
        bound_ms < BUDGET_MS and not wrong,
    )]  # fmt: skip


def holds(stage, port, expected, hold_s):
    """Watch the crowd for a while. Return what does not hold, or an empty text; the upper bound of the time; all values."""
    before, began = read_page(port), time.monotonic()
    time.sleep(hold_s)
    after, took_s = read_page(port), time.monotonic() - began
    least_ms, bound_ms = frame_and_publish_ms(before, after)
    frames = Durations(before, after, FRAME).count
    rejoins, demotions = (
        total(after, name) - total(before, name) for name in ("tandem_rejoins_total", "tandem_demotions_total")
    )
    heard = [client for client in top(stage).get("clients", []) if client["phase"] == "playing"]
    lag_ms = max((client["lag_ms"] for client in heard), default=0)
    says = f"p99 between {least_ms:.1f} and {bound_ms:.1f} ms, {frames / took_s:.1f} frames/s, slowest client {lag_ms:.0f} ms behind"
    wrong = ""
    if least_ms >= BUDGET_MS:
        wrong = "the server's time"
    elif frames < FRAMES_PER_S * (0.99 * took_s - 0.5):  # each page may be a quarter of a second old
        wrong = "the rate"
    elif rejoins or demotions or playing(port) != expected:
        wrong = f"{rejoins:.0f} rejoins, {demotions:.0f} demotions, {playing(port):.0f} of {expected} playing"
    elif lag_ms > 1000:
        wrong = "a client that falls behind"
    return wrong, bound_ms, says


def largest(stage, minutes, _):
    """The largest crowd at 10,000 bodies: 20 observers more at a time, until something does not hold."""
    bodies, steps = 10_000, 20
    hold_s = max(minutes * 60 / steps, 5)
    _, port = start_server(stage, bodies)
    groups = participants(stage, minutes * 120 + 120)
    for group in groups:
        group.wait(JOIN_S)
    held, proven, measured, limit = 0, 0, "", f"no limit up to {10 + 20 * steps}"
    for _ in range(steps):
        try:
            for _ in range(2):
                groups.append(observers(stage))
                groups[-1].wait(JOIN_S)
            expected = sum(group.count for group in groups)
            wait_until(lambda: playing(port) == expected, 30, f"{expected} clients that play")  # noqa: B023
        except Failed as failure:
            limit = f"not {held + 20}: {failure}"
            break
        time.sleep(2)
        wrong, bound_ms, says = holds(stage, port, expected, hold_s)
        print(f"  {expected} clients: {says}{'; does not hold: ' + wrong if wrong else ''}", flush=True)
        if wrong:
            limit = f"not {expected}: {wrong} ({says})"
            break
        held, measured = expected, says
        if bound_ms < BUDGET_MS:
            proven = expected
    return [(
        f"the largest number of clients at {bodies:,} bodies, server and clients on one machine",
        "stated",
        f"{held} ({measured}), {proven} with the upper bound below {BUDGET_MS} ms; {limit}; {hold_s:.0f} s for each 20 more",
        held > 0,
    )]  # fmt: skip


def start_viewers(stage):
    """Start a gateway and its viewers."""
    gateway = stage.start(stage.options.gateway, "--port", 0, "--address-connections", 4 * VIEWERS, "--address-joins",
                          4 * VIEWERS)  # fmt: skip
    gateway.wait_for("playing from frame", 60)
    wait_until(lambda: port_of(gateway, "session "), 20, "the gateway's address")
    viewers = stage.start(stage.options.viewers, "--port", port_of(gateway, "session "), "--viewers", VIEWERS)
    viewers.wait_for(f"{VIEWERS} viewers play", 60)
    return gateway, viewers


def hour(stage, minutes, _):
    """An hour of a session: five clients, one that comes each 30 s, a gateway with 50 viewers, a recorder."""
    bodies, seconds = 10_000, minutes * 60
    server, port = start_server(stage, bodies)
    programs = {"server": server}
    groups = [Group(stage, 2, "--input-script", stage.pushes(seconds + 60)), Group(stage, 3, "--observe")]
    programs["participants"], programs["observers"] = (group.process for group in groups)
    programs["gateway"], viewers = start_viewers(stage)
    programs["recorder"] = stage.start(stage.options.tandem, "record", stage.path("hour.mcap"), "--json")
    programs["recorder"].wait_for("playing from frame", 60)
    for group in groups:
        group.wait(JOIN_S)
    watch, began = Watch(server, port, programs), time.monotonic()
    every_s = min(30, seconds / 3)
    wrong, came = [], 0
    while time.monotonic() < began + seconds:
        guest = observers(stage, 1)
        guest.wait(JOIN_S)
        time.sleep(max(0, min(began + (came + 1) * every_s, began + seconds) - time.monotonic()))
        wrong += guest.stop()
        came += 1
    before, after, took_s = watch.stop()
    if watch.fault:
        raise Failed(watch.fault)
    for group in groups:
        wrong += group.stop()
    watched = end_viewers(viewers)
    programs["gateway"].stop()
    recorded = programs["recorder"].stop()
    server.stop()
    if recorded["hash_mismatches"] or recorded["resyncs"]:
        wrong.append(f"the recorder: {recorded['resyncs']} rejoins")
    if watched["playing"] != VIEWERS or watched["gaps"] or watched["lost"]:
        wrong.append(f"viewers: {watched}")
    warm_s = min(WARM_S, took_s / 2)
    grown = {name: growth_percent(samples, warm_s) for name, samples in watch.memory.items()}
    flat = all(percent < 1 for percent in grown.values())
    rate = Durations(before, after, FRAME).count / took_s
    waited_s = total(after, "tandem_suspended_seconds_total") - total(before, "tandem_suspended_seconds_total")
    return [
        (
            f"an hour at 30 Hz, {bodies:,} bodies, 5 clients, one joining each 30 s, gateway with {VIEWERS} viewers, "
            "recorder: memory after ten minutes",
            "grows by less than 1 %",
            f"after {warm_s / 60:.1f} minutes: " + ", ".join(
                f"{name} {grown[name]:+.1f} % of {watch.memory[name][-1][1] / 1024:.1f} MB" for name in grown)
            + f"; what the server has allocated {growth_percent(watch.heap, warm_s):+.1f} % of {watch.heap[-1][1] / 1024:.1f} MB",
            flat,
        ),
        (
            "the same: frames",
            "none above 50 ms but by the scheduler; each client complete",
            f"{watch.late} above 50 ms, {watch.own} of them not by the scheduler; {rate:.2f} frames/s, {waited_s:.1f} s "
            f"waited for participants; {came} came and went; {len(wrong)} incomplete"
            + (f": {', '.join(sorted(set(wrong))[:3])}" if wrong else ""),
            watch.own == 0 and not wrong,
        ),
    ]  # fmt: skip


def end_viewers(viewers):
    viewers.process.send_signal(signal.SIGINT)
    out = viewers.output(30)
    if not out:
        raise Failed(f"the viewers gave no report: {json.dumps([line for _, line in viewers.lines[-3:]])}")
    return out
