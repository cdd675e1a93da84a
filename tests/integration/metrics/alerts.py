"""Unit tests of the alert rules for `promtool test rules`: an hour of normal play, and then each fault."""

import json
import pathlib
import subprocess

STEP_S = 5  # scrape_interval of deploy/metrics/prometheus.yml
HOUR = 3600 // STEP_S  # steps
FIRES_S = 30  # after its fault begins

SERVER = 'job="tandemd",instance="127.0.0.1:9730"'
GATEWAY = 'job="tandem-gateway",instance="127.0.0.1:9731"'
RECORDER = 'job="tandem-recorder",instance="127.0.0.1:9732"'
RELAY = 'job="tandem-relay",instance="127.0.0.1:9733"'

REPEATED = f"tandem_repeated_bytes_total{{{SERVER}}}"

# Series to its first value and what a step of normal play adds. A client comes back and is demoted once an hour, and the
# recorder joined again once: normal play is not perfect.
NORMAL = {
    f"up{{{SERVER}}}": (1, 0),
    f"up{{{GATEWAY}}}": (1, 0),
    f"up{{{RECORDER}}}": (1, 0),
    f"up{{{RELAY}}}": (1, 0),
    f"tandem_relay_followers{{{RELAY}}}": (3, 0),
    f"tandem_relay_published_bytes_total{{{RELAY}}}": (0, 50_000),
    f"tandem_relay_repeated_bytes_total{{{RELAY}}}": (0, 3_000),  # 2 % on each of three links
    f"tandem_relay_given_up_frames_total{{{RELAY}}}": (7, 0),
    f"tandem_alive{{{SERVER}}}": (1, 0),
    f"tandem_alive{{{GATEWAY}}}": (1, 0),
    f"tandem_ready{{{SERVER}}}": (1, 0),
    f"tandem_ready{{{GATEWAY}}}": (1, 0),
    f"tandem_frame_rate_hertz{{{SERVER}}}": (29.9, 0),
    f"tandem_frame_rate_target_hertz{{{SERVER}}}": (30, 0),
    f'tandem_server_state{{{SERVER},state="running"}}': (1, 0),
    f'tandem_server_state{{{SERVER},state="waiting"}}': (0, 0),
    f"tandem_hidden_bodies{{{SERVER}}}": (0, 0),
    f"tandem_repeated_demotions_total{{{SERVER}}}": (1, 0),
    f"tandem_rejoins_total{{{SERVER}}}": (1, 0),
    f"tandem_frames_total{{{SERVER}}}": (0, 150),
    f'tandem_payload_bytes_total{{{SERVER},stream="thin"}}': (0, 30_000),
    f'tandem_payload_bytes_total{{{SERVER},stream="rich"}}': (0, 20_000),
    REPEATED: (0, 1_300),  # 2 %, as on a radio
    f"tandem_client_server_alive{{{GATEWAY}}}": (1, 0),
    f"tandem_client_frames_applied_total{{{GATEWAY}}}": (0, 150),
    f"tandem_client_hash_mismatches_total{{{GATEWAY}}}": (0, 0),
    f"tandem_client_resyncs_total{{{GATEWAY}}}": (0, 0),
    f"tandem_client_resyncs_total{{{RECORDER}}}": (1, 0),
    f"tandem_recorder_file_good{{{RECORDER}}}": (1, 0),
    f"tandem_recorder_disk_free_bytes{{{RECORDER}}}": (1e11, 0),
    f"tandem_recorder_written_bytes_total{{{RECORDER}}}": (1e6, 1e6),
    f'tandem_server_state{{{SERVER},state="standing_by"}}': (0, 0),
    f"tandem_checkpoint_age_seconds{{{SERVER}}}": (2, 0),
    f"tandem_checkpoint_interval_seconds{{{SERVER}}}": (1, 0),
}

# Alert to what its fault changes: a series' value from then on, and what each further step adds.
FAULTS = [
    ("TandemGone", {f"up{{{SERVER}}}": (0, 0)}),
    ("TandemGone", {f"up{{{GATEWAY}}}": (0, 0)}),
    ("TandemGone", {f"up{{{RELAY}}}": (0, 0)}),
    ("TandemRelayLink", {f"tandem_relay_repeated_bytes_total{{{RELAY}}}": (3_000 * HOUR, 30_000)}),
    ("TandemRelayGap", {f"tandem_relay_given_up_frames_total{{{RELAY}}}": (90, 0)}),
    ("TandemHangs", {f"tandem_alive{{{SERVER}}}": (0, 0)}),
    ("TandemServerLost", {f"tandem_client_server_alive{{{GATEWAY}}}": (0, 0)}),
    ("TandemRateNotHeld", {f"tandem_frame_rate_hertz{{{SERVER}}}": (24, 0)}),
    ("TandemBodiesHidden", {f"tandem_hidden_bodies{{{SERVER}}}": (3, 0)}),
    ("TandemClientDemotedRepeatedly", {f"tandem_repeated_demotions_total{{{SERVER}}}": (2, 1)}),
    ("TandemHashMismatch", {f"tandem_client_hash_mismatches_total{{{GATEWAY}}}": (1, 0)}),
    ("TandemCheckpointOld", {f"tandem_checkpoint_age_seconds{{{SERVER}}}": (5, 5)}),
    ("TandemCheckpointOld", {f'tandem_server_state{{{SERVER},state="running"}}': (0, 0),
                             f'tandem_server_state{{{SERVER},state="standing_by"}}': (1, 0),
                             f"tandem_checkpoint_age_seconds{{{SERVER}}}": (61, 5)}),
    ("TandemNoSpace", {f"tandem_recorder_disk_free_bytes{{{RECORDER}}}": (9e8, 0)}),
    ("TandemNoSpace", {f"tandem_recorder_disk_free_bytes{{{RECORDER}}}": (2e9, 0),
                       f"tandem_recorder_written_bytes_total{{{RECORDER}}}": (1e9, 1e8)}),
    ("TandemNoSpace", {f"tandem_recorder_file_good{{{RECORDER}}}": (0, 0)}),
    ("TandemLinkLoss", {REPEATED: (1_300 * HOUR, 13_000)}),
    ("TandemRejoins", {f"tandem_client_resyncs_total{{{RECORDER}}}": (2, 1)}),
    ("TandemRejoins", {f"tandem_rejoins_total{{{SERVER}}}": (4, 0)}),
]  # fmt: skip
# An alert that is no fault's of the issue, and may take longer.
SLOW_FAULTS = [("TandemNotReady", {f"tandem_ready{{{GATEWAY}}}": (0, 0)}, 75)]
# Changes that are no fault.
HARMLESS = [
    # The server waits for participants before frame 1.
    {
        f'tandem_server_state{{{SERVER},state="running"}}': (0, 0),
        f'tandem_server_state{{{SERVER},state="waiting"}}': (1, 0),
        f"tandem_frame_rate_hertz{{{SERVER}}}": (0, 0),
        f"tandem_ready{{{SERVER}}}": (0, 0),
        f"tandem_checkpoint_age_seconds{{{SERVER}}}": (10, 5),
    },
    # --rate max
    {f"tandem_frame_rate_target_hertz{{{SERVER}}}": (0, 0)},
    # A link that was cut for half a minute is back.
    {REPEATED: (1_300 * HOUR + 400_000, 1_300)},
    # One more demotion, one more join.
    {f"tandem_repeated_demotions_total{{{SERVER}}}": (2, 0), f"tandem_rejoins_total{{{SERVER}}}": (2, 0)},
]

FIRING = 'count by (alertname) (ALERTS{alertstate="firing"})'


def values(normal, then):
    """In promtool's notation: an hour, and five minutes of what comes then."""
    first, grows = normal
    text = f"{first:g}{grows:+g}x{HOUR - 1}"
    after, grows = then or (first + grows * HOUR, grows)
    return f"{text} {after:g}{grows:+g}x60"


def case(name, changes, alert, after_s):
    """Silent for an hour; after that `alert` alone, or nothing if it is None."""
    unknown = set(changes) - set(NORMAL)
    assert not unknown, unknown
    fired = [{"labels": f'{{alertname="{alert}"}}', "value": 1}] if alert else []
    return {
        "name": name,
        "interval": f"{STEP_S}s",
        "input_series": [{"series": series, "values": values(normal, changes.get(series))} for series, normal in NORMAL.items()],
        "promql_expr_test": [
            {"expr": 'count_over_time(ALERTS{alertstate="firing"}[1h])', "eval_time": f"{3600 - STEP_S}s", "exp_samples": []},
            {"expr": FIRING, "eval_time": f"{3600 + after_s}s", "exp_samples": fired},
        ],
    }


def cases():
    tests = [case(f"{alert} {i}", changes, alert, FIRES_S) for i, (alert, changes) in enumerate(FAULTS)]
    tests += [case(alert, changes, alert, after_s) for alert, changes, after_s in SLOW_FAULTS]
    return tests + [case(f"harmless {i}", changes, None, 250) for i, changes in enumerate(HARMLESS)]


def check(rules, folder):
    """Raises AssertionError with promtool's words. Returns the number of cases and the names of alerts that have one."""
    file = pathlib.Path(folder) / "alerts.test.yml"
    file.write_text(json.dumps({"rule_files": [str(rules)], "evaluation_interval": f"{STEP_S}s", "tests": cases()}), "utf-8")
    done = subprocess.run(["promtool", "test", "rules", file], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return len(cases()), {alert for alert, *_ in FAULTS + SLOW_FAULTS}
