#!/usr/bin/env python3
"""Simulations in numpy that tandemd streams: tandem.Server, the example, and an engine that dies."""

import contextlib
import importlib.util
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock
import urllib.error
import urllib.request

import numpy as np

import stage

import tandem

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "sdk/examples"

COUNTER = """
import sys, numpy as np, tandem
n = 8
state = {"frame": 0}
x = lambda: np.arange(n)[:, None] * [1, 0, 0] + [0, 0.001 * state["frame"], 0]
def load(data):
    state["frame"] = int(data)
    print("loaded", state["frame"], flush=True)
    return {"position": x()}
with tandem.Server(n, 1 / 30, name="counter", application_limit=8, gravity_limit=50, threshold=0.01, extent=100,
                   save=lambda: str(state["frame"]).encode(), load=load, options=sys.argv[1:]) as server:
    server.start(position=x())
    for frame in server.frames():
        state["frame"] = frame.number
        for each in frame.inputs:
            print(frame.number, each.kind, [float(v) for v in each.values], each.bytes, flush=True)
            if each.bytes == b"fail": 1 / 0
            if each.bytes == b"die": frame.write(alive=np.arange(n) != 3)
            if each.bytes == b"live": frame.write(alive=True)
            if each.bytes == b"again": frame.write(reborn=[5])
        frame.write(position=x())
"""


def wait_for(what, holds, limit_s=stage.LIMIT_S):
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        value = holds()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"{what} did not come about")


@contextlib.contextmanager
def running(folder, name, command):
    """A process whose output goes to a file; gives (process, text of it so far)."""
    path = pathlib.Path(folder) / f"{name}.log"
    with open(path, "wb") as out, subprocess.Popen(list(map(str, command)), stdout=out, stderr=out) as process:
        try:
            yield process, lambda: path.read_text(encoding="utf-8", errors="replace")
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(stage.LIMIT_S)
            except subprocess.TimeoutExpired:
                process.kill()


def metrics_of(log):
    """The page of metrics, at the address that the log names."""
    address = re.search(r"http://[0-9.]+:[0-9]+", log)
    if not address:
        return ""
    with urllib.request.urlopen(address[0] + "/metrics", timeout=5) as page:
        return page.read().decode()


def answers(url):
    """Whether something is there; it may have no files of a viewer."""
    try:
        return urllib.request.urlopen(url, timeout=5).status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return None


class Server(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())

    def test_the_example_plays_and_is_short(self):
        lines = (EXAMPLES / "boids.py").read_text(encoding="utf-8").splitlines()
        self.assertLessEqual(sum(bool(line.strip()) for line in lines), 31)
        command = [sys.executable, "-B", EXAMPLES / "boids.py", *stage.common("boids")]
        with running(self.folder, "boids", command) as (process, text):
            with contextlib.suppress(AssertionError):
                wait_for("the session", lambda: "epoch" in text())
            stage.tool("join", *stage.common("boids"), "--timeout", stage.LIMIT_S, "--seconds", 2, "--json")
            self.assertIsNone(process.poll(), text())
            process.send_signal(signal.SIGINT)

    @unittest.skipUnless(os.environ.get("TANDEM_GATEWAY"), "the gateway was not built")
    def test_the_cloth_hangs_together_and_a_viewer_is_there(self):
        command = [sys.executable, "-B", EXAMPLES / "cloth.py", *stage.common("cloth")]
        with running(self.folder, "cloth", command) as (process, text), tandem.Client("cloth", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            url = wait_for("the address", lambda: text().partition("look at ")[2].partition("\n")[0])
            wait_for("the gateway", lambda: answers(url))
            wait_for("frames", lambda: client.sample().frame > 120)
            position = client.sample().positions
            self.assertLess(float(abs(position).max()), 15)
            self.assertGreater(float(position[:, 1].min()), -12)
            process.send_signal(signal.SIGINT)
            process.wait(stage.LIMIT_S)
            self.assertIsNone(answers(url), "the gateway ended with it")

    @unittest.skipUnless(importlib.util.find_spec("lammps"), "python3-lammps is not installed")
    def test_lammps_in_python_falls_and_is_tilted(self):
        command = [sys.executable, "-B", EXAMPLES / "grains.py", *stage.common("grains")]
        with running(self.folder, "grains", command) as (process, text), tandem.Client("grains", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            start = client.sample().positions.mean(axis=0)
            wait_for("the fall", lambda: client.sample().positions[:, 2].mean() < start[2] - 1)
            client.send_gravity((20, 0, -5))
            wait_for("the tilt", lambda: client.sample().positions[:, 0].mean() > start[0] + 0.3)
            self.assertIsNone(process.poll(), text())

    def test_keys_and_events_reach_a_client_with_their_frame(self):
        with tandem.Server(8, 1 / 30, session="told", domain=stage.DOMAIN, keys=True, events=True) as server:
            server.set_key("phase", b"warm-up")
            server.set_key("gone", b"")
            server.start(position=np.arange(8)[:, None] * np.ones(3))
            with tandem.Client("told", domain=stage.DOMAIN) as client:
                heard, keys, began = [], {}, 0
                for frame in server.frames():
                    heard += client.news()
                    if client.status().phase == tandem.Phase.PLAYING and not began:
                        began, keys = frame.number, {name: client.key(name) for name in client.keys()}
                        server.remove_key("gone")
                    if began and frame.number < began + 100:
                        server.broadcast(7, str(frame.number).encode(), body=3)
                        server.set_key("score", str(frame.number - began).encode())
                    if frame.number == began + 50:  # more than a message holds, and more than a frame tells
                        for i in range(100):
                            server.broadcast(8, i.to_bytes(2, "big") * 512)
                    if began and client.key("score") == b"99":
                        break
                    self.assertLess(frame.number, 30 * stage.LIMIT_S)
                heard += client.news()
                self.assertEqual(keys, {"phase": b"warm-up", "gone": b""})
                self.assertEqual(client.keys(), ["phase", "score"])
                events = [news for news in heard if news.what == tandem.NewsKind.EVENT]
                numbers = [news.number for news in events]
                self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))), "none is lost or double")
                small = [news for news in events if news.event == 7]
                before = [news for news in small if news.frame <= began + 49]
                self.assertEqual([int(news.data) for news in before], [news.frame for news in before])
                self.assertGreater(len(before), 10)
                self.assertEqual({news.body for news in small}, {(3, 0)})
                large = [int.from_bytes(news.data[:2], "big") for news in events if news.event == 8]
                self.assertEqual(large, list(range(100)))
                self.assertEqual(client.status().hash_mismatches, 0)

    def test_what_no_session_takes_is_refused_where_it_is_told(self):
        with tandem.Server(8, 1 / 30, session="refused", domain=stage.DOMAIN, keys=True, events=True) as server:
            for wrong in ("", "two\nlines", "k" * 65, "naïve"):
                with stage.refused(self, tandem.Result.INVALID_ARGUMENT):
                    server.set_key(wrong, b"")
            for kind, data, body in ((-1, b"", None), (1 << 31, b"", None), (1, bytes(1025), None), (1, b"", 8), (1, b"", -1)):
                with stage.refused(self, tandem.Result.INVALID_ARGUMENT):
                    server.broadcast(kind, data, body)
            with stage.refused(self, tandem.Result.INVALID_ARGUMENT):
                server.set_key("large", bytes(1 << 16))
            with stage.refused(self, tandem.Result.CAPACITY):
                for _ in range(3000):
                    server.broadcast(1, bytes(1024))
        with tandem.Server(8, 1 / 30, session="refused", domain=stage.DOMAIN) as server:
            for call in (lambda: server.set_key("a", b""), lambda: server.remove_key("a"), lambda: server.broadcast(1)):
                with stage.refused(self, tandem.Result.UNSUPPORTED):
                    call()

    def play_counter(self, *options):
        script = pathlib.Path(self.folder) / "counter.py"
        script.write_text(COUNTER, encoding="utf-8")
        return running(self.folder, "counter", [sys.executable, "-B", script, *stage.common("counter"), *options])

    def test_inputs_reach_the_loop_and_slots_tell_births_and_deaths(self):
        with self.play_counter() as (_, text), tandem.Client("counter", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            client.send_gravity((1, -2, 3))
            client.send_push((1, 0, 0), 2.5, (0, 4, 0))
            wait_for("gravity", lambda: "gravity [1.0, -2.0, 3.0]" in text())
            wait_for("the push", lambda: "push [1.0, 0.0, 0.0, 2.5, 0.0, 4.0, 0.0]" in text())
            alive = lambda: client.sample().alive
            self.assertTrue(alive().all())
            client.send_bytes(b"die")
            wait_for("a death", lambda: not alive()[3])
            self.assertEqual(int(alive().sum()), 7)
            client.send_bytes(b"live")
            wait_for("a birth", lambda: alive().all())
            number = client.send_bytes(b"far too long")
            said = wait_for("the refusal", lambda: [e.text for e in client.events() if e.number == number and e.text])
            self.assertIn("at most 8 bytes", said[0])
            self.assertEqual(client.status().hash_mismatches, 0)

    def test_an_exception_in_the_loop_is_told_by_the_server(self):
        with self.play_counter() as (process, text), tandem.Client("counter", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            client.send_bytes(b"fail")
            process.wait(stage.LIMIT_S)
            self.assertIn("the engine gave up in frame", text())
            self.assertIn("ZeroDivisionError: division by zero", text())

    def test_a_killed_engine_goes_on_from_the_last_checkpoint_in_a_new_epoch(self):
        script = pathlib.Path(self.folder) / "counter.py"
        script.write_text(COUNTER, encoding="utf-8")
        command = [os.environ["TANDEMD"], "--engine", f"exec {sys.executable} -B {script}", *stage.common("counter"),
                   "--checkpoint-dir", pathlib.Path(self.folder) / "kept", "--checkpoint-interval", 0.2, "--metrics", "0"]  # fmt: skip
        with running(self.folder, "tandemd", command) as (process, text), tandem.Client("counter", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            epoch = client.status().epoch
            engine = wait_for("the engine", lambda: text().partition(", process ")[2].partition(":")[0])
            wait_for("frames", lambda: client.sample().frame > 30)
            os.kill(int(engine), signal.SIGSTOP)
            wait_for("the line", lambda: "is stopped in frame" in text())
            held = client.sample().frame
            wait_for("its state", lambda: 'tandem_engine_state{state="stopped"} 1' in metrics_of(text()))
            os.kill(int(engine), signal.SIGCONT)
            wait_for("it to go on", lambda: client.sample().frame > held + 5)
            self.assertEqual(client.status().epoch, epoch)
            os.kill(int(engine), signal.SIGKILL)
            wait_for("the line", lambda: "the engine hung up" in text())
            wait_for("another epoch", lambda: client.status().epoch > epoch and client.status().phase == tandem.Phase.PLAYING)
            self.assertIn("loaded", text())
            self.assertGreater(client.scene().continues_frame, 0)
            self.assertEqual(client.status().hash_mismatches, 0)
            self.assertIsNone(process.poll())
            page = wait_for("a restart", lambda: (lambda page: page if "tandem_engine_restarts_total 1" in page else "")(metrics_of(text())))
            self.assertIn('tandem_engine_info{engine="counter"} 1', page)
            self.assertIn('tandem_engine_state{state="serves"} 1', page)
            count = page.partition("tandem_engine_round_trip_seconds_count ")[2].partition("\n")[0]
            self.assertGreater(float(count), 30)

    def test_an_engine_on_another_machine_shows_a_token_and_is_saved(self):
        script, token = pathlib.Path(self.folder) / "counter.py", pathlib.Path(self.folder) / "token"
        script.write_text(COUNTER, encoding="utf-8")
        token.write_text("0123456789abcdef\n", encoding="utf-8")
        token.chmod(0o600)
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        command = [os.environ["TANDEMD"], "--engine-listen", f"127.0.0.1:{port}", "--engine-token", token, *stage.common("counter"),
                   "--checkpoint-dir", pathlib.Path(self.folder) / "kept", "--checkpoint-interval", 0.2]  # fmt: skip
        with running(self.folder, "tandemd", command) as (_, text):
            wait_for("the port", lambda: f"waits for an engine at tcp:127.0.0.1:{port}" in text())
            engine = lambda shown: running(self.folder, f"engine_{shown}", ["env", f"TANDEM_DOOR=tcp:127.0.0.1:{port}", f"TANDEM_DOOR_TOKEN={shown}",
                                                                          sys.executable, "-B", script])  # fmt: skip
            with engine("0123456789abcdeX") as (stranger, said):
                stranger.wait(stage.LIMIT_S)
                self.assertIn("did not show the token", said())
            with engine("0123456789abcdef") as (first, _), tandem.Client("counter", domain=stage.DOMAIN) as client:
                client.wait_until_playing(stage.LIMIT_S)
                epoch = client.status().epoch
                wait_for("frames", lambda: client.sample().frame > 30)
                first.kill()
                wait_for("the line", lambda: "the engine hung up" in text())
                wait_for("another wait", lambda: text().count("waits for an engine") == 2)
                with engine("0123456789abcdef") as (_, said):
                    wait_for("another epoch", lambda: client.status().epoch > epoch and client.status().phase == tandem.Phase.PLAYING)
                    self.assertIn("loaded", said())
                    self.assertGreater(client.scene().continues_frame, 0)
                    self.assertEqual(client.status().hash_mismatches, 0)

    def stands_by(self, script, name, *options):
        return running(self.folder, name, [os.environ["TANDEMD"], "--engine", f"exec {sys.executable} -B {script}",
                                           *stage.common("counter"), *options])  # fmt: skip

    def test_a_server_with_an_engine_stands_by_and_takes_over_when_the_engine_of_the_live_one_dies(self):
        script = pathlib.Path(self.folder) / "counter.py"
        script.write_text(COUNTER, encoding="utf-8")
        one = lambda text: int(wait_for("the engine", lambda: text().partition(", process ")[2].partition(":")[0]))
        with self.stands_by(script, "live") as (live, said), tandem.Client("counter", domain=stage.DOMAIN) as client:
            client.wait_until_playing(stage.LIMIT_S)
            with self.stands_by(script, "standby", "--standby") as (standby, told):
                wait_for("the standby", lambda: "loaded" in told())
                os.kill(one(told), signal.SIGKILL)  # its own engine, while it stands by
                wait_for("another engine", lambda: told().count("loaded") >= 2 and "the engine hung up" in told())
                wait_for("frames", lambda: client.sample().frame > 90)
                time.sleep(1.5)  # it holds a checkpoint again
                epoch = client.status().epoch
                os.kill(one(said), signal.SIGKILL)
                wait_for("a takeover", lambda: "takes over from epoch" in told())
                wait_for("another epoch", lambda: client.status().epoch > epoch and client.status().phase == tandem.Phase.PLAYING)
                self.assertGreater(client.scene().continues_frame, 60)
                self.assertNotIn("goes on from the checkpoint, and", told())
                self.assertEqual(client.status().hash_mismatches, 0)
                live.wait(stage.LIMIT_S)  # it finds the other one
                self.assertIn("already has a server", said())
                self.assertIsNone(standby.poll())

    def test_another_engine_that_no_session_can_have_does_not_end_the_server(self):
        script = pathlib.Path(self.folder) / "moody.py"
        script.write_text("""
import os, pathlib, numpy as np, tandem
starts = pathlib.Path(__file__).with_name("starts")
count = len(starts.read_text()) if starts.exists() else 0
starts.write_text("x" * (count + 1))
with tandem.Server(2, 1 / 30, gravity=(0, 1e9 if count == 1 else 0, 0)) as server:
    server.start(position=np.zeros((2, 3)))
    for frame in server.frames():
        frame.write(position=np.zeros((2, 3)))
        if count == 0 and frame.number == 5: os._exit(3)
""", encoding="utf-8")  # fmt: skip
        command = [os.environ["TANDEMD"], "--engine", f"exec {sys.executable} -B {script}", *stage.common("moody")]
        with running(self.folder, "tandemd", command) as (_, text), tandem.Client("moody", domain=stage.DOMAIN) as client:
            wait_for("the refusal", lambda: "must be finite and at most" in text())
            wait_for("the third engine", lambda: client.status().phase == tandem.Phase.PLAYING and client.sample().frame > 10)

    def test_an_engine_that_does_not_save_is_told_so(self):
        script = pathlib.Path(self.folder) / "counter.py"
        script.write_text(COUNTER.replace('save=lambda: str(state["frame"]).encode(), load=load, ', ""), encoding="utf-8")
        with self.stands_by(script, "standby", "--standby") as (process, text):
            self.assertEqual(process.wait(stage.LIMIT_S), 2, text())
            self.assertIn("does not save", text())
        with self.stands_by(script, "live") as (_, text):
            wait_for("the warning", lambda: "the world begins anew at frame 0" in text())

    def test_what_the_server_refuses_is_an_error_here(self):
        with self.assertRaises(tandem.Error) as raised:
            tandem.Server(0, 1 / 30, options=stage.common("refused"))
        self.assertIn("`capacity=0`: '0' is not a whole number of 1 to", str(raised.exception))
        for wrong, said in {
            "gravity_limit=-1": "`gravity_limit=-1`: '-1' is not a number",
            "types=[tandem.Type('crate', radius=-1)]": "radius '-1' is not a number",
            "types=[tandem.Type('crate', shape='box', values=(1, 2))]": "a box has 3 shape values, not 2",
            "hello=['plane 0 2 0 0']": "`plane 0 2 0 0`: the normal has length 2, not 1",
            "types=[tandem.Type('my crate')]": "a name has no blanks",
            "types=[tandem.Type('crate', colour='red')]": "Type 'crate': a colour is '#RRGGBB'",
            "gravity=(0, float('nan'), 0)": "`gravity=0.0 nan 0.0`: 'nan' is not a number",
            "dt=0": "`dt=0.0`: '0.0' is not a number of 0.001 to 1",
            "up='w'": "`up=w`: must be x, y or z",
        }.items():
            with self.subTest(wrong), self.assertRaises((tandem.Error, ValueError)) as raised:
                eval(f"tandem.Server(1, **{{'dt': 1 / 30, **dict({wrong})}}, options=stage.common('refused'))")
            self.assertIn(said, str(raised.exception))
            self.assertNotIn("HELLO", str(raised.exception))
        with self.assertRaisesRegex(tandem.Error, "--bogus"):
            tandem.Server(1, 1 / 30, options=[*stage.common("refused"), "--bogus"])
        folder = "/no_such_folder/x"
        with self.assertRaisesRegex(tandem.Error, "no_such_folder"), tandem.Server(
            1, 1 / 30, options=[*stage.common("refused"), "--checkpoint-dir", folder]
        ) as server:
            server.start(position=[(0, 0, 0)])
            for _ in server.frames():
                self.fail("it plays")
        with self.assertRaises(TypeError), tandem.Server(4, 1 / 30, options=stage.common("refused")) as server:
            server.start(positions=[])

    def served(self, frames, *options):
        """The numbers of the frames that a server asks for."""
        with tandem.Server(1, 1 / 30, options=[*stage.common("ends"), *options]) as server:
            server.start(position=[(0, 0, 0)])
            for frame in server.frames():
                frames.append(frame.number)
                yield server

    def test_only_a_planned_end_ends_the_loop_quietly(self):
        planned, killed, stopped = [], [], []
        for _ in self.served(planned, "--duration", 0.5):
            pass
        self.assertGreater(len(planned), 3)
        for server in self.served(stopped):
            server._process.terminate()
        self.assertTrue(stopped)
        with self.assertRaisesRegex(tandem.Error, "SIGKILL"):
            for server in self.served(killed):
                server._process.kill()

    def test_a_session_that_is_taken_is_an_error_that_says_so(self):
        with tandem.Server(1, 1 / 30, options=stage.common("taken")) as first:
            first.start(position=[(0, 0, 0)])
            frames = first.frames()
            next(frames)
            with self.assertRaisesRegex(tandem.Error, "already has a server") as raised, tandem.Server(1, 1 / 30, options=stage.common("taken")) as second:
                second.start(position=[(0, 0, 0)])
                for _ in second.frames():
                    self.fail("it got a frame")
            self.assertEqual(raised.exception.code, tandem.Result.CONFLICT)
            self.assertIn("an earlier tandem.Server of this process has it", str(raised.exception))
            next(frames)

    def test_a_gateway_that_ends_is_told(self):
        with unittest.mock.patch.dict(os.environ, TANDEM_GATEWAY="/bin/false"), self.assertWarnsRegex(UserWarning, "tandem-gateway ended with exit code 1"):
            with tandem.Server(1, 1 / 30, options=stage.common("blind"), view=True) as server:
                server.start(position=[(0, 0, 0)])
                server._viewer.wait()
                next(server.frames())


if __name__ == "__main__":
    unittest.main()
