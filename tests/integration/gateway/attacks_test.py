#!/usr/bin/env python3
"""Bytes that no browser sends: nobody ends tandem-gateway with them, or gets an answer that belongs to somebody else.

attacks_test.py SCENARIO --tandemd PATH --tandem PATH --gateway PATH --viewer PATH        Exit 0 passed, 1 failed.
"""

import argparse
import contextlib
import socket
import struct
import sys
import tempfile
import time

from gateway_test import TOKEN, Failed, WebStage, check_viewer

HOST = b"Host: 127.0.0.1\r\n"
UPGRADE = b"Connection: Upgrade\r\nUpgrade: %s\r\n"
WEBSOCKET = UPGRADE % b"websocket" + (
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: tandem.4\r\n"
)
MASK = bytes(4)


def get(path, more=b"", method=b"GET"):
    return method + b" " + path + b" HTTP/1.1\r\n" + HOST + more + b"\r\n"


def viewer(more=b""):
    return get(b"/tandem", WEBSOCKET + more)


def frame(first, body=b"", length=None):
    """Of WebSocket, masked; `length`: what it says of its body, if that is a lie."""
    said = len(body) if length is None else length
    size = bytes([0x80 | said]) if said < 126 else b"\xfe" + struct.pack(">H", said) if said < 65536 else b"\xff" + struct.pack(">Q", said)
    return bytes([first]) + size + MASK + body


def http2(kind, flags, stream, body=b""):
    return struct.pack(">I", len(body))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + body


def say(stage, *pieces, source="127.0.0.1"):
    """All that comes back within 0.3 s of silence; b"" if the connection ends at once."""
    got = b""
    with socket.create_connection(("127.0.0.1", stage.port), 10, (source, 0)) as connection, contextlib.suppress(OSError):
        for piece in pieces:
            connection.sendall(piece)
            time.sleep(0.05)
        connection.settimeout(0.3)
        while piece := connection.recv(65536):
            got += piece
            if len(got) > 100_000:
                break
    return got


def answers(got):
    return got.count(b"HTTP/1.1 ") + got.count(b"HTTP/1.0 ")


def protocols(stage):
    """No upgrade but to WebSocket, no HTTP/2, no frames that WebSocket does not have: a viewer plays on meanwhile."""
    stage.server("server")
    stage.gateway("gateway", "--address-connections", 1000, "--address-joins", 1000)
    stage.viewer("good", "--seconds", 11)
    stage.wait(lambda: len(stage.hashes("good")) > 30, "a viewer to play")
    settings = b"HTTP2-Settings: AAMAAABkAAQAAP__\r\nSec-WebSocket-Protocol: tandem.4\r\n"
    preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
    asks = b"\x82\x84\x86\x41\x01x"  # GET / of host x, in HPACK
    streams = preface + http2(4, 0, 0), http2(1, 5, 3, asks), http2(1, 5, 5, asks)
    for name, pieces in {
        "h2c": (get(b"/tandem", UPGRADE % b"h2c" + settings), *streams),
        "h2c of another path": (get(b"/", UPGRADE % b"h2c" + settings), *streams),
        "H2C, websocket": (get(b"/tandem", UPGRADE % b"H2C, websocket" + settings), *streams),
        "HTTP/2 from the start": (streams[0], http2(1, 5, 1, asks)),
        "mqtt": (get(b"/tandem", UPGRADE % b"mqtt" + settings),),
        "a WebSocket with a body": (viewer(b"Content-Length: 5\r\n"), b"hello"),
        "a WebSocket by POST": (viewer().replace(b"GET", b"POST", 1),),
    }.items():
        got = say(stage, *pieces)
        print(f"  {name}: {got[:40]!r}", flush=True)
        if b" 101 " in got or b" 200 " in got or stage.processes["gateway"].poll() is not None:
            raise Failed(f"{name}: {got[:200]!r}, exit {stage.processes['gateway'].poll()}")
    for name, flood in {
        "reserved bits": frame(0xF2, b"hello"),
        "an opcode that does not exist": frame(0x83, b"hello"),
        "a long ping": frame(0x89, bytes(126)),
        "a ping in parts": frame(0x09, b"hello"),
        "a frame without a mask": b"\x82\x05hello",
        "a continuation of nothing": frame(0x80, b"hello"),
        "8 EiB": frame(0x82, b"hello", (1 << 63) - 1),
        "less than nothing": frame(0x82, b"hello", (1 << 64) - 1),
        "5,000 empty parts": frame(0x02) + frame(0x00) * 5000,
        "a close of one byte": frame(0x88, b"x"),
        "compression that was not agreed": frame(0xC2, b"hello"),
        "a message with the request": b"",
    }.items():
        got = say(stage, viewer(b"Sec-WebSocket-Extensions: permessage-deflate\r\n") + (frame(0x82, b"hello") if not flood else b""), flood)
        if b" 101 " not in got or b"permessage" in got or stage.processes["gateway"].poll() is not None:
            raise Failed(f"{name}: {got[:200]!r}, exit {stage.processes['gateway'].poll()}")
    if stage.health()["viewers"] != 1:
        stage.wait(lambda: stage.health()["viewers"] == 1, "the others to be gone")
    report = stage.end("good")
    stage.stop("server")
    if report["connections"] != 1:
        raise Failed(f"the viewer was disconnected: {report}")
    check_viewer(stage, "good", ["server"], 100, report)


def smuggling(stage):
    """What follows a request in its body is no request, whatever the head says of the body."""
    token = stage.folder / "token"
    token.write_text(TOKEN + "\n", encoding="ascii")
    token.chmod(0o600)
    proxy = "127.0.0.5"
    stage.gateway("gateway", "--token-file", token, "--trusted-proxy", proxy)
    hidden = get(b"/login", b"X-Forwarded-For: 198.51.100.1\r\nAuthorization: Bearer %s\r\n" % TOKEN.encode())
    chunks = b"%x\r\n%s\r\n0\r\n\r\n" % (len(hidden), hidden)
    for method in (b"GET", b"HEAD", b"POST", b"PUT", b"OPTIONS"):
        for name, head, body in (
            ("a length", b"Content-Length: %d\r\n" % len(hidden), hidden),
            ("chunks", b"Transfer-Encoding: chunked\r\n", chunks),
            ("chunks and a length", b"Content-Length: 4\r\nTransfer-Encoding: chunked\r\n", chunks),
            ("two lengths", b"Content-Length: 0\r\nContent-Length: %d\r\n" % len(hidden), hidden),
            ("a length below zero", b"Content-Length: -1\r\n", hidden),
        ):
            for pieces in ((get(b"/healthz", head, method) + body,), (get(b"/healthz", head, method), body)):
                got = say(stage, *pieces)
                if answers(got) > 1 or TOKEN.encode() in got:
                    raise Failed(f"{method} with {name}: {answers(got)} answers: {got}")
    print("  one answer at most for each")
    got = say(stage, get(b"/healthz") + get(b"/healthz"))
    if answers(got) != 2:
        raise Failed(f"two honest requests: {answers(got)} answers")
    # Behind X-A, libwebsockets overlooks a header; a proxy does not.
    for head, body in ((b"Transfer-Encoding: chunked\r\n", chunks), (b"Content-Length: %d\r\n" % len(hidden), hidden)):
        got = say(stage, get(b"/healthz", b"X-A: b\r\n" + head) + body, source=proxy)
        if answers(got) != 1:
            raise Failed(f"through a proxy, {head}: {answers(got)} answers: {got}")
    for line in (b"X-Forwarded-For: 198.51.100.1\r\nX-Forwarded-For: 198.51.100.2\r\n",
                 b"X-Forwarded-For: 198.51.100.1\r\nAccept: b\r\nx-forwarded-for: 198.51.100.3, 198.51.100.2\r\n"):  # fmt: skip
        say(stage, viewer(line), source=proxy)
    stage.wait(lambda: (stage.folder / "gateway.err").read_text().count("audit: refused from=198.51.100.2 ") == 2, "the address that the proxy added")
    for path in (b"/login?token=x%0d%0aSet-Cookie:%20a=b", b"/a%0d%0ab: c"):
        if b"a=b" in (got := say(stage, get(path))) or b"b: c" in got:
            raise Failed(f"{path}: {got}")


SCENARIOS = {scenario.__name__: scenario for scenario in (protocols, smuggling)}


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
