"""Normal play, watched with the deployed configuration: no alert fires, and how far the figures stay from each limit."""

import os
import pathlib
import random
import re
import time

from programs import Prometheus, get, wait_for

INPUTS = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "quickstart-inputs" / "participant-1.textproto"
# What alerts compare, in parts of their limit: 1 would fire once its time is over.
NEAREST = {
    "missing frames": "(1 - min_over_time(min(tandem_frame_rate_hertz / tandem_frame_rate_target_hertz)[{s}s:5s])) / 0.1",
    "repeated deltas": "max_over_time((sum(rate(tandem_repeated_bytes_total[10s])) / (sum(rate(tandem_payload_bytes_total[10s]))"
    " + 100 * sum(rate(tandem_frames_total[10s]))))[{s}s:5s]) / 0.1",
    "age of a checkpoint": "max(max_over_time(tandem_checkpoint_age_seconds[{s}s])) / 10",
    "rejoins": "max_over_time((max(increase(tandem_rejoins_total[5m])))[{s}s:5s]) / 3",
    "repeated demotions": "max_over_time((max(increase(tandem_repeated_demotions_total[10m])))[{s}s:5s]) / 2",
}


def comes_and_goes(stage, chance):
    """A client for some seconds: it ends as it should, or is killed."""
    role = chance.choice(((), ("--observe",)))
    stage.start("guest", stage.options.tandem, "join", *role, "--seconds", chance.randrange(5, 20))
    if chance.random() < 0.3:
        time.sleep(chance.uniform(1, 5))
        stage.processes["guest"].kill()
    stage.processes["guest"].wait()


def fired(prometheus, seconds):
    return {row["metric"]["alertname"] for row in prometheus.query(f'count_over_time(ALERTS{{alertstate="firing"}}[{seconds}s])')}


def run(stage):
    seed = int(os.environ.get("SEED", "30"))
    print(f"seed {seed}", flush=True)
    chance = random.Random(seed)
    places = stage.session("--input-script", INPUTS)
    viewers = re.compile(r"(http://[0-9.:]+)/")
    wait_for(lambda: viewers.search(stage.log("gateway")), "the gateway's address")
    stage.start("viewer", stage.options.tandem, "join", "--observe", "--url", viewers.search(stage.log("gateway")).group(1))
    for job, address in places.items():
        wait_for(lambda at=address: get(at, "/readyz")[0] == 200, f"{job} ready")
    prometheus = Prometheus(stage, places)
    began = time.monotonic()
    while time.monotonic() < began + 60 * stage.options.minutes:
        comes_and_goes(stage, chance)
        time.sleep(chance.uniform(0, 5))
        for name in ("server", "gateway", "recorder", "participant", "viewer"):
            assert stage.processes[name].poll() is None, f"{name} has ended"
        assert not (alerts := fired(prometheus, 3600)), alerts
    seconds = int(time.monotonic() - began)
    for what, query in NEAREST.items():
        result = prometheus.query(query.format(s=seconds))
        assert result, f"nothing of {query}"
        print(f"{what}: {float(result[0]['value'][1]):.2f} of the limit at most", flush=True)
    print(f"{seconds / 60:.0f} minutes of normal play: no alert", flush=True)
