#!/usr/bin/env python3
"""Who gets in at tandem-gateway: signed tokens with roles, how they are shown, what is wrong with them, and SIGHUP.

tokens_test.py SCENARIO --tandemd PATH --tandem PATH --gateway PATH --viewer PATH        Exit 0 passed, 1 failed.
"""

import argparse
import base64
import json
import os
import pathlib
import signal
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

from gateway_test import TOKEN, Failed, WebStage, certificate, raw

UPGRADE = (
    "GET /tandem%s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: tandem.4\r\n%s\r\n"
)


def expect(got, wanted, what):
    if got != wanted:
        raise Failed(f"{what}: {got!r}, not {wanted!r}")
    print(f"  {what}: {got!r}", flush=True)


def pki(stage, *arguments, code=0):
    """What `tandem pki` says."""
    done = subprocess.run([stage.options.tandem, "pki", *map(str, arguments)], capture_output=True, text=True, timeout=60, check=False)
    if done.returncode != code:
        raise Failed(f"tandem pki {arguments}: exit {done.returncode}: {done.stderr}")
    return (done.stderr if code else done.stdout).strip()


def key_pair(stage, name):
    key = stage.folder / name
    pki(stage, "token-key", key)
    return key, pathlib.Path(f"{key}.pub")


def token(stage, key, role, *more, expires="1h"):
    return pki(stage, "token", "--key", key, "--role", role, "--expires", expires, *more)


def signed(stage, key, **claims):
    """A token that `tandem pki token` would not make, with a good signature."""
    url = lambda data: base64.urlsafe_b64encode(data).decode().rstrip("=")  # noqa: E731
    text = url(b'{"alg":"EdDSA","typ":"JWT"}') + "." + url(json.dumps(claims).encode())
    message = stage.folder / "message"
    message.write_text(text)
    made = subprocess.run(["openssl", "pkeyutl", "-sign", "-rawin", "-inkey", key, "-in", message], check=True, capture_output=True)
    return f"{text}.{url(made.stdout)}"


def close_code(stage, query="", head=""):
    """The close code and text of a WebSocket that is refused; (0, "") for one that is let in."""
    # Who is let in gets frames for as long as he is silent, so the first one is enough.
    first = lambda got: len(got.partition(b"\r\n\r\n")[2]) > 100  # noqa: E731  (longer than a close)
    answer = raw(stage.port, (UPGRADE % (query, stage.port, head)).encode(), enough=first)
    if b" 101 " not in answer[:20]:
        return answer[:40].split(b"\r\n")[0].decode(), ""
    frame = answer.split(b"\r\n\r\n", 1)[1]
    return (int.from_bytes(frame[2:4], "big"), frame[4:].decode()) if frame[0] & 15 == 8 else (0, "")


def log_of(stage, name="gateway"):
    return (stage.folder / f"{name}.err").read_text()


def roles(stage):
    """A watcher sees and cannot act; who may act acts; the token comes by header, cookie or address, and never into the log."""
    key, public = key_pair(stage, "key")
    watch, act = token(stage, key, "watch", "--name", "ann"), token(stage, key, "act", "--name", "ben")
    stage.server("server")
    stage.gateway("gateway", "--token-key", public)
    stage.viewer("watches", "--seconds", 6, "--query", f"?token={watch}", "--input-every", 0.3)
    stage.viewer("acts", "--seconds", 6, "--query", f"?token={act}", "--input-every", 0.3)
    reports = {name: stage.end(name) for name in ("watches", "acts")}
    for name, report in reports.items():
        print(f"  {name}: {report['role']}, {report['inputs_acted']} acted, {report['inputs_refused']} refused")
    if reports["watches"]["role"] != "observer" or reports["watches"]["inputs_acted"] or not reports["watches"]["frames_applied"]:
        raise Failed(f"a watcher: {reports['watches']}")
    if reports["acts"]["role"] != "participant" or not reports["acts"]["inputs_acted"]:
        raise Failed(f"who may act: {reports['acts']}")

    expect(close_code(stage, head=f"Authorization: Bearer {act}\r\n"), (0, ""), "Authorization")
    expect(close_code(stage, head=f"Cookie: a=b; tandem_token_{stage.port}={act}\r\n"), (0, ""), "a cookie")
    expect(close_code(stage, head=f"Cookie: tandem_token_1={act}\r\n")[0], 4001, "the cookie of another port")
    expect(close_code(stage, head=f"Authorization: Basic {act}\r\n")[0], 4001, "another scheme")
    # Behind a proxy with a login of its own, whatever that is.
    for scheme in ("Basic dXNlcjpwYXNz", "Bearer of-the-proxy"):
        for how in (f"Tandem-Token: {act}", f"Cookie: tandem_token_{stage.port}={act}"):
            expect(close_code(stage, head=f"Authorization: {scheme}\r\n{how}\r\n"), (0, ""), f"{how.split(':')[0]} behind Authorization: {scheme}")
        status, body, headers = stage.get("/login", Authorization=scheme, **{"Tandem-Token": watch})
        expect((status, body, f"={watch}" in headers["set-cookie"]), (200, b"watch\n", True), f"/login behind Authorization: {scheme}")
    status, body, headers = stage.get("/login", Authorization=f"Bearer {watch}")
    expect((status, body), (200, b"watch\n"), "/login")
    cookie = headers["set-cookie"]
    if not all(part in cookie for part in (f"tandem_token_{stage.port}={watch}", "HttpOnly", "SameSite=Strict", "Max-Age=36")):
        raise Failed(f"cookie: {cookie}")
    status, body, headers = stage.get("/login", Authorization="Bearer wrong")
    expect((status, body, headers["set-cookie"]), (401, b"token missing or wrong\n", None), "/login with a wrong token")
    expect(headers["www-authenticate"], 'Bearer realm="tandem"', "whose answer it is")
    stage.wait(lambda: log_of(stage).count("audit: refused") == 3, "the wrong token at /login in the log")
    for what, path, headers in (("the address", f"/login?token={watch}", {}), ("a cookie", "/login", {"Cookie": f"tandem_token_{stage.port}={watch}"})):
        # A link or a picture of another site's page could do that.
        status, _, answered = stage.get(path, **headers)
        expect((status, answered["set-cookie"]), (401, None), f"/login with a token in {what}")
    _, _, headers = stage.get("/")
    for name, part in (("content-security-policy", "default-src 'none'"), ("content-security-policy", "frame-ancestors 'self'"),
                       ("x-content-type-options", "nosniff"), ("referrer-policy", "no-referrer")):  # fmt: skip
        if part not in (headers[name] or ""):
            raise Failed(f"{name}: {headers[name]}")
    expect(headers["strict-transport-security"], None, "HSTS without TLS")

    stage.wait(lambda: log_of(stage).count("audit: left") > 3, "viewers to leave")
    said = log_of(stage)
    for line in ('name="ann" role=watch', 'name="ben" role=act', "gravity_acted=0 gravity_refused=", "gravity_reason=observer",
                 "push_reason=observer", "audit: left viewer=", 'audit: refused from=127.0.0.1 origin="" reason="token'):  # fmt: skip
        if line not in said:
            raise Failed(f"the log has no {line}:\n{said}")
    if any(part in said for one in (watch, act) for part in (one, one.rsplit(".", 1)[1])):
        raise Failed("a token is in the log")

    stage.port = 0
    stage.gateway("json", "--token-key", public, "--log-format", "json")
    close_code(stage, f"?token={act}")
    stage.wait(lambda: "audit: left" in log_of(stage, "json"), "the viewer to leave")
    lines = [json.loads(line) for line in log_of(stage, "json").splitlines()]
    if not any(line["message"].startswith("audit: joined") and line["program"] == "tandem-gateway" for line in lines):
        raise Failed(f"no line of JSON says who joined: {lines}")


def bad_tokens(stage):
    """Of another key, of tomorrow, expired, of no role, of another session, a megabyte long: nobody gets in, each is told why."""
    key, public = key_pair(stage, "key")
    other, _ = key_pair(stage, "other")
    stage.gateway("gateway", "--token-key", public)
    good = token(stage, key, "act")
    now_s = int(time.time())
    for text, reason, what in (
        ("", "token missing or wrong", "none"),
        (token(stage, other, "act"), "token missing or wrong", "of another key"),
        (good[:-1], "token missing or wrong", "cut short"),
        (token(stage, key, "act", "--from", "1d"), "token not valid yet: is a clock wrong?", "of tomorrow"),
        (token(stage, key, "act", "--session", "other"), "token of another session", "of another session"),
        (signed(stage, key, role="act", exp=now_s - 61), "token expired", "expired"),
        (signed(stage, key, role="act", exp=now_s + 60, nbf=now_s + 86_400), "token not valid yet: is a clock wrong?", "by a clock off by a day"),
        (signed(stage, key, role="admin", exp=now_s + 60), "token of a role that does not exist", "of a role that does not exist"),
        (signed(stage, other, role="admin", exp=now_s - 61), "token missing or wrong", "of another key, which hears nothing more"),
        ("A" * 1500, "token missing or wrong", "of 1,500 characters"),
    ):
        expect(close_code(stage, f"?token={text}"), (4001, reason), what)
    expect(close_code(stage, f"?token={'A' * 1_000_000}")[0], "", "a megabyte in the address")
    expect(close_code(stage, head=f"Authorization: Bearer {'A' * 1_000_000}\r\n")[0], "", "a megabyte in a header")
    expect(close_code(stage, f"?token={good}"), (0, ""), "a good one")
    counted = stage.health()["refused"]
    expect(counted["token missing or wrong"], 5, "counted as wrong")
    expect(counted["token expired"], 1, "counted as expired")
    expect(counted["token of a role that does not exist"], 1, "counted as of no role")
    expect(counted["token of another session"], 1, "counted as another session's")
    pki(stage, "token", "--key", key, "--role", "admin", "--expires", "1h", code=2)
    pki(stage, "token", "--key", key, "--role", "act", "--expires", "forever", code=2)
    expect("lasts from" in pki(stage, "token", "--key", key, "--role", "act", "--expires", "400d", code=1), True, "a token for 400 days")
    pki(stage, "token-key", key, code=1)  # is there already
    key.chmod(0o644)
    said = pki(stage, "token", "--key", key, "--role", "act", "--expires", "1h", code=1)
    expect(f"chmod 600 {key}" in said and len(said.splitlines()) == 1, True, "a key that the world can read")

    def ends(*arguments):
        stage.start("usage", stage.options.gateway, "--port", 0, *arguments)
        code = stage.processes["usage"].wait(60)
        said = (stage.folder / "usage.err").read_text().strip().splitlines()
        print(f"  {said[-1]}")
        if not code or len(said) > 2:
            raise Failed(f"{arguments}: exit {code}, {said}")

    public.chmod(0o666)
    ends("--token-key", public)  # everybody can write it
    ends("--token-key", key)  # the secret one
    ends("--token-key", stage.folder / "missing")
    authority = stage.folder / "pki"
    pki(stage, "init", "--dir", authority)
    pki(stage, "issue", "gateway", "web", "--dir", authority)
    (authority / "web" / "key.pem").chmod(0o644)
    ends("--secure", authority / "web")  # a key of DDS Security that the world can read
    cert, its_key = certificate(stage, "cert")
    _, foreign = certificate(stage, "foreign")
    ends("--tls-cert", cert, "--tls-key", foreign)
    cut = stage.folder / "cut.crt"
    cut.write_text(cert.read_text()[:300])
    ends("--tls-cert", cut, "--tls-key", its_key)
    its_key.chmod(0o644)
    ends("--tls-cert", cert, "--tls-key", its_key)


def reload(stage):
    """At SIGHUP keys and certificate change while viewers watch; a broken file changes nothing and is named."""
    key, public = key_pair(stage, "key")
    new_key, new_public = key_pair(stage, "new")
    cert, its_key = certificate(stage, "first")
    new_cert, new_its_key = certificate(stage, "second")
    first = cert.read_text()
    text = stage.folder / "text"
    text.write_text(TOKEN + "\n")
    text.chmod(0o600)
    stage.gateway("gateway", "--token-key", public, "--token-file", text, "--tls-cert", cert, "--tls-key", its_key)
    pid = stage.processes["gateway"].pid

    def served():
        return ssl.get_server_certificate(("127.0.0.1", stage.port)).strip()

    def hang_up(line):
        """Waits for a further line."""
        before = log_of(stage).count(line)
        os.kill(pid, signal.SIGHUP)
        stage.wait(lambda: log_of(stage).count(line) > before, line)

    def login(given):
        context = ssl._create_unverified_context()
        request = urllib.request.Request(f"https://127.0.0.1:{stage.port}/login", headers={"Authorization": f"Bearer {given}", "Host": "lab.example"})
        try:
            with urllib.request.urlopen(request, timeout=10, context=context) as answer:
                return answer.status, answer.headers
        except urllib.error.HTTPError as error:
            return error.code, error.headers

    old, new = token(stage, key, "act"), token(stage, new_key, "act")
    status, headers = login(old)
    expect((status, login(new)[0], login(TOKEN)[0]), (200, 401, 200), "before: the old key's, the new key's, the text")
    expect(headers["strict-transport-security"], "max-age=15552000", "HSTS with TLS, to a name")
    expect("; Secure" in headers["set-cookie"], True, "a cookie that goes by TLS only")
    stage.viewer("stays", "--seconds", 100, "--timeout", 60, "--once", "--tls-ca", cert, "--query", f"?token={old}", log=False)
    stage.wait(lambda: "audit: joined" in log_of(stage), "a viewer")

    cert.write_text(first[:300])
    hang_up("the certificate stays as it was")
    cert.write_text(new_cert.read_text())
    hang_up("do not belong together")
    expect(served() == first.strip(), True, "a broken certificate changes nothing")
    its_key.write_text(new_its_key.read_text())
    hang_up("the certificate was read again")
    expect(served() == new_cert.read_text().strip(), True, "the new certificate")

    good = public.read_text()
    public.write_text("nonsense")
    hang_up("tokens stay as they were")
    expect(login(old)[0], 200, "a broken key changes nothing")
    public.write_text(good)
    text.write_text("another-text-of-20-characters\n")
    hang_up("tokens were read again")
    expect((login(old)[0], login(TOKEN)[0]), (200, 401), "another text")
    if "audit: left" in log_of(stage):
        raise Failed("the viewer was let go too early")
    public.write_text(new_public.read_text())
    hang_up("tokens were read again")
    expect((login(old)[0], login(new)[0]), (401, 200), "another key")
    report = stage.end("stays")
    expect([close["code"] for close in report["closed"]], [4001], "the viewer of the old key is let go")


SCENARIOS = {scenario.__name__: scenario for scenario in (roles, bad_tokens, reload)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", choices=SCENARIOS)
    for program in ("tandemd", "tandem", "gateway", "viewer"):
        parser.add_argument(f"--{program}", required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with WebStage(options, folder) as stage:
                SCENARIOS[options.scenario](stage)
        except Failed as error:
            print(f"{options.scenario}: {error}", file=sys.stderr)
            return 1
    print(f"{options.scenario}: passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
