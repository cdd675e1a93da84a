#!/usr/bin/env python3
"""Who may do what with DDS Security: real programs on a network of this test's own, and an intruder.

secure.py --tandemd PATH --tandem PATH --intruder PATH [--deaf LIBRARY] [--list | CASE ...]

Exit 0 passed, 1 failed, 77 not run: namespaces are not allowed here. Some two minutes.
"""

import pathlib
import shutil
import subprocess
import sys
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "fault"))
from stage import Failed, arguments, run  # noqa: E402

ROLES = ["server", "participant", "observer", "gateway", "operator"]
TOPICS = {
    "TandemSession", "TandemDelta", "TandemScheduledInput", "TandemSnapshot", "TandemReply", "TandemServerStatus",
    "TandemInput", "TandemAck", "TandemClientStatus", "TandemJournal", "TandemCheckpoint", "TandemStandby", "TandemCommand",
}  # fmt: skip
PUSH = "inputs {{ time_s: {:.2f} push {{ centre {{ y: 5 }} radius_m: 3 velocity_change {{ y: 1 }} }} }}\n"
SECONDS = 6  # an intruder stays for so long
OWN_ID = "0000000000000bad"  # of the intruder, when it speaks for itself


def pki(stage, *words, folder="pki"):
    done = subprocess.run(
        [stage.options.tandem, "pki", *map(str, words), "--dir", f"{stage.folder}/{folder}"], capture_output=True,
        text=True, timeout=30, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise Failed(done.stderr)
    return done.stdout


def authorities(stage, folder="pki"):
    said = pki(stage, "init", folder=folder)
    for role in ROLES:
        said += pki(stage, "issue", role, role, folder=folder)
    if "PRIVATE" in said:
        raise Failed("a key was printed")
    return pathlib.Path(stage.folder) / folder


def expect(truth, what):
    if not truth:
        raise Failed(what)


def intrude(stage, identity):
    said = stage.start(stage.options.intruder, "default", identity, SECONDS).output(SECONDS + 30)
    expect(said, "the intruder said nothing")
    return said


def writes(said):
    return {topic for topic in TOPICS if said[topic][0]}


def received(said):
    return {topic: said[topic][3] for topic in TOPICS if said[topic][3]}


def matched(said):
    return {topic: said[topic][1] for topic in TOPICS if said[topic][1]}


def watched(stage, identities, intruder_identity):
    """A session with an honest participant and an observer while somebody intrudes. Returns what the intruder could do."""
    script = pathlib.Path(stage.folder) / "inputs.textproto"
    script.write_text("".join(PUSH.format(i / 5) for i in range(5, 60)))
    server = stage.server(500, "--secure", identities / "server")
    honest = stage.client("--secure", identities / "participant", "--input-script", script)
    observer = stage.client("--secure", identities / "observer", "--observe")
    for each in (honest, observer):
        each.wait_for("playing from frame", 30)
    said = intrude(stage, intruder_identity)
    time.sleep(1)
    reports = [each.stop() for each in (honest, observer)]
    totals = server.stop()
    roles = [role for role in ("participant", "observer") if server.first(f"client {OWN_ID} plays as {role}") is not None]
    said["plays as"], said["delayed"] = " and ".join(roles), server.first(f"client {OWN_ID} delayed the others") is not None
    for report in reports:
        expect(report["frames_applied"] > 30 and not report["hash_mismatches"], f"a client did not play: {report}")
        expect(report["epochs"] == 1 and not report["resyncs"], f"a client followed another: {report}")
    lost = reports[0]["inputs_sent"] - reports[0]["inputs_acted"]
    expect(reports[0]["inputs_sent"] > 10 and lost <= 1, f"{lost} of {reports[0]['inputs_sent']} honest inputs lost")
    print(f"  writes {sorted(writes(said))}, matched {matched(said)}, received {received(said)}; "
          f"plays as {said['plays as'] or 'nobody'}; server refused "
          f"{totals['refused_inputs']} inputs and {totals['refused_messages']} messages")  # fmt: skip
    return said, totals


def everybody_with_an_identity_plays(stage):
    """Server, standby, clients of each role, top and handover, each with its identity."""
    identities = authorities(stage)
    pki(stage, "issue", "server", "second")
    server = stage.server(200, "--secure", identities / "server")
    clients = [stage.client("--secure", identities / "participant"),
               stage.client("--secure", identities / "gateway"),
               stage.client("--observe", "--secure", identities / "observer")]  # fmt: skip
    for client in clients:
        client.wait_for("playing from frame", 30)
    top = stage.start(stage.options.tandem, "top", "--once", "--json", "--secure", identities / "observer").output(30)
    expect(top.get("sessions") and len(top["clients"]) == 3, f"top shows {top}")
    standby = stage.start(stage.options.tandemd, "--scene", "half_pipe", "--bodies", 200, "--seed", 1, "--standby",
                          "--secure", identities / "second")  # fmt: skip
    standby.wait_for("holds", 30)
    refused = stage.start(stage.options.tandem, "handover", "--secure", identities / "participant")
    refused.wait_for("TandemCommand", 30)
    handed = stage.start(stage.options.tandem, "handover", "--json", "--secure", identities / "operator").output(60)
    expect(handed.get("continues_epoch"), f"handover said {handed}")
    time.sleep(3)
    reports = [client.stop() for client in clients]
    expect(all(report["epochs"] == 2 and not report["hash_mismatches"] for report in reports), f"after it: {reports}")
    server.stop()


def a_stranger_gets_and_gives_nothing(stage):
    identities = authorities(stage)
    said, _ = watched(stage, identities, "-")
    expect(not received(said) and not matched(said), "a stranger was heard, or heard something")


def another_authority_gets_and_gives_nothing(stage):
    identities = authorities(stage)
    theirs = authorities(stage, "theirs")
    for role in ("server", "participant"):
        said, _ = watched(stage, identities, theirs / role)
        expect(not received(said) and not matched(said), f"a {role} of another authority was heard, or heard something")


def a_participant_writes_its_own_topics_only(stage):
    """And it cannot speak for another client: the server binds ids to participants."""
    identities = authorities(stage)
    pki(stage, "issue", "participant", "mallory")
    said, totals = watched(stage, identities, identities / "mallory")
    expect(writes(said) == {"TandemAck", "TandemInput", "TandemClientStatus"}, "a participant writes more")
    expect(said["victim"] and matched(said).get("TandemInput"), "the intruder did not try")
    expect(totals["refused_inputs"] + totals["refused_messages"] > 0, "what it forged was not refused")
    expect(said["plays as"] == "participant" and said["delayed"], "it did not try to make all wait")


def an_observer_cannot_send_input(stage):
    """Nor can it make the others wait, though it asks for a participant's place."""
    identities = authorities(stage)
    pki(stage, "issue", "observer", "mallory")
    said, _ = watched(stage, identities, identities / "mallory")
    expect(writes(said) == {"TandemAck", "TandemClientStatus"}, "an observer writes more")
    expect(said["plays as"] == "observer" and not said["delayed"], "an observer had a participant's place")
    asked = stage.start(stage.options.tandem, "join", "--secure", identities / "mallory", "--timeout", 5)
    asked.wait_for("join as an observer", 10)


def an_operator_only_commands(stage):
    identities = authorities(stage)
    said, _ = watched(stage, identities, identities / "operator")
    expect(writes(said) == {"TandemCommand"}, "an operator writes more")
    expect("TandemDelta" not in received(said), "an operator reads the bodies")


def revoked_identities_stay_out(stage):
    """A server with the newest list refuses one that was revoked, although that one has an old list."""
    identities = authorities(stage)
    pki(stage, "issue", "participant", "mallory")
    stolen = pathlib.Path(stage.folder) / "stolen"
    shutil.copytree(identities / "mallory", stolen)
    pki(stage, "revoke", "mallory")
    said, _ = watched(stage, identities, stolen)
    expect(not received(said) and not matched(said), "a revoked identity was heard, or heard something")
    asked = stage.start(stage.options.tandem, "join", "--secure", identities / "mallory", "--timeout", 5)
    asked.wait_for("was revoked", 10)


def bad_files_are_named(stage):
    """Each program ends with one line; unit_pki tries all files."""
    identities = authorities(stage)
    key = identities / "server" / "key.pem"
    key.chmod(0o644)
    for command, code in [
        ([stage.options.tandemd, "--scene", "cube", "--bodies", 5, "--secure", key.parent], 2),
        ([stage.options.tandem, "join", "--timeout", 2, "--secure", key.parent], 1),
        ([stage.options.tandem, "top", "--once", "--secure", key.parent], 1),
        ([stage.options.tandem, "handover", "--secure", key.parent], 1),
        ([stage.options.tandem, "record", f"{stage.folder}/x.mcap", "--secure", key.parent], 1),
    ]:
        started = stage.start(*command)
        started.wait_for(f"{key} can be read by others", 20)
        expect(started.process.wait(20) == code, f"{command[0]} ended with {started.process.returncode}")
    key.chmod(0o600)
    asked = stage.start(stage.options.tandemd, "--scene", "cube", "--bodies", 5, "--secure", identities / "participant")
    asked.wait_for("tandem pki issue server", 20)
    said = stage.start(stage.options.tandem, "doctor", "--json", "--secure", identities / "server").output(30)
    expect(any(c["name"] == "security" and c["verdict"] == "ok" for c in said["checks"]), f"doctor said {said}")


def who_has_no_identity_is_told(stage):
    """On loopback nothing is said; elsewhere one warning by the server, and one by the doctor."""
    server = stage.server(5)
    expect(server.first("without --secure") is None, "a warning on loopback")
    server.stop()
    subprocess.run(["ip", "link", "add", "net0", "type", "veth", "peer", "name", "net1"], check=True)
    for words in (["addr", "add", "10.9.0.1/24", "dev", "net0"], ["link", "set", "net0", "up"], ["link", "set", "net1", "up"]):
        subprocess.run(["ip", *words], check=True)
    stage.interface = "net0"
    server = stage.start(stage.options.tandemd, "--scene", "cube", "--bodies", 5)
    server.wait_for("everybody who reaches 10.9.0.1", 20)
    time.sleep(3)
    expect(sum("without --secure" in line for _, line in server.lines) == 1, "more than one warning")
    said = stage.start(stage.options.tandem, "doctor", "--json").output(30)
    expect(any(c["name"] == "security" and c["verdict"] == "warning" for c in said["checks"]), f"doctor said {said}")
    subprocess.run(["ip", "link", "del", "net0"], check=True)


def no_handshake_has_a_deadline(stage):
    """Otherwise Cyclone DDS 0.10 breaks when a handshake runs out of time: it has to call the function that does nothing."""
    function = "dds_security_fsm_set_timeout"
    for program in (stage.options.tandemd, stage.options.tandem):
        said = subprocess.run([program, "--version"], env={"LD_BIND_NOW": "1", "LD_DEBUG": "bindings"}, capture_output=True,
                              text=True, timeout=60, check=True).stderr  # fmt: skip
        bound = [line for line in said.splitlines() if f"`{function}'" in line and "binding file" in line and "libddsc" in line]
        expect(bound and all(f" to {program} [" in line for line in bound), f"{program}: {bound or said[-300:]}")


def who_hears_nothing_any_more_ends(stage):
    """A client and a server whose handshakes spin end with a reason and exit code 1; the others go on with the standby."""
    if not stage.options.deaf:
        print("  not tried: this build cannot be preloaded")
        return
    identities = authorities(stage)
    pki(stage, "issue", "server", "second")
    folder = pathlib.Path(stage.folder)

    def deafened(name):
        return "env", f"LD_PRELOAD={stage.options.deaf}", f"TANDEM_DEAF={folder / name}"

    world = "--scene", "half_pipe", "--bodies", 200, "--seed", 1
    server = stage.start(*deafened("server"), stage.options.tandemd, *world, "--secure", identities / "server")
    server.wait_for("session 'default'", 60)
    standby = stage.start(stage.options.tandemd, *world, "--standby", "--secure", identities / "second")
    standby.wait_for("holds", 30)
    client = stage.client("--secure", identities / "participant")
    broken = stage.start(*deafened("client"), stage.options.tandem, "join", "--secure", identities / "participant")
    for each in (client, broken):
        each.wait_for("playing from frame", 30)
    for name, deaf in (("client", broken), ("server", server)):
        (folder / name).touch()
        for _ in range(2):  # the first newcomer meets the error, the second one stops what learns of newcomers
            stage.client("--observe", "--secure", identities / "observer")
            time.sleep(1)
        deaf.wait_for("Cyclone DDS hears nothing any more", 60)
        code = deaf.process.wait(20)
        expect(code == 1, f"the {name} ended with {code}")
    standby.wait_for("takes over", 30)
    time.sleep(3)
    report = client.stop()
    expect(report["epochs"] == 2 and not report["hash_mismatches"], f"a client did not go on: {report}")


CASES = {case.__name__: case for case in (
    everybody_with_an_identity_plays, a_stranger_gets_and_gives_nothing, another_authority_gets_and_gives_nothing,
    a_participant_writes_its_own_topics_only, an_observer_cannot_send_input, an_operator_only_commands,
    revoked_identities_stay_out, bad_files_are_named, who_has_no_identity_is_told,
    no_handshake_has_a_deadline, who_hears_nothing_any_more_ends,
)}  # fmt: skip


def main():
    parser = arguments(__doc__)
    parser.add_argument("--intruder", type=pathlib.Path, required=True)
    parser.add_argument("--deaf", type=pathlib.Path, help="what makes a program deaf, preloaded")
    options = parser.parse_args()
    return run(CASES, options.cases, parser, options)


if __name__ == "__main__":
    sys.exit(main())
