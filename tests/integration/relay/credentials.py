"""Certificates, and users of NATS by an operator's tokens (.creds), made with the program openssl."""

import base64
import json
import pathlib
import subprocess

PREFIX = {"operator": 14 << 3, "account": 0, "user": 20 << 3}
SEED = 18 << 3


def openssl(*arguments, data=None):
    return subprocess.run(["openssl", *map(str, arguments)], input=data, capture_output=True, check=True).stdout


def certificates(folder):
    """An authority, and a server's certificate of it for 127.0.0.1: (authority, certificate, key)."""
    folder = pathlib.Path(folder)
    ca, ca_key, cert, key, ask = (folder / name for name in ("ca.pem", "ca-key.pem", "hub.pem", "hub-key.pem", "hub.csr"))
    new = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    openssl("req", "-x509", *new, "-keyout", ca_key, "-out", ca, "-subj", "/CN=authority", "-days", 2)
    openssl("req", *new, "-keyout", key, "-out", ask, "-subj", "/CN=hub", "-addext", "subjectAltName=IP:127.0.0.1")
    openssl("x509", "-req", "-in", ask, "-CA", ca, "-CAkey", ca_key, "-CAcreateserial", "-copy_extensions", "copy", "-days", 2, "-out", cert)
    return ca, cert, key


def crc16(data):
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1
    return (crc & 0xFFFF).to_bytes(2, "little")


def text(data):
    return base64.b32encode(data + crc16(data)).decode().rstrip("=")


def url64(data):
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


class Key:
    """A key of NATS (nkey): ed25519."""

    def __init__(self, folder, kind, name):
        self.kind, self.file = kind, pathlib.Path(folder) / f"{kind}-{name}.pem"
        openssl("genpkey", "-algorithm", "ed25519", "-out", self.file)
        raw = openssl("pkey", "-in", self.file, "-outform", "DER")[-32:]
        public = openssl("pkey", "-in", self.file, "-pubout", "-outform", "DER")[-32:]
        prefix = PREFIX[kind]
        self.public = text(bytes([prefix]) + public)
        self.seed = text(bytes([SEED | prefix >> 5, (prefix & 31) << 3]) + raw)

    def token(self, of, name, claims):
        """A token of this key for another."""
        body = {"jti": f"{name}-{of.public[:8]}", "iat": 1_700_000_000, "iss": self.public, "name": name, "sub": of.public,
                "nats": {**claims, "type": of.kind, "version": 2}}  # fmt: skip
        signed = url64(json.dumps({"typ": "JWT", "alg": "ed25519-nkey"}).encode()) + "." + url64(json.dumps(body).encode())
        message = self.file.with_suffix(".message")
        message.write_text(signed, encoding="ascii")
        return signed + "." + url64(openssl("pkeyutl", "-sign", "-rawin", "-inkey", self.file, "-in", message))


class Operator:
    """An operator with one account: `configuration` is what nats-server has to know of them."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        key, self.account = Key(folder, "operator", "o"), Key(folder, "account", "a")
        everything = dict.fromkeys(("subs", "data", "payload", "imports", "exports", "conn", "leaf"), -1)
        account = key.token(self.account, "TANDEM", {"limits": {**everything, "wildcards": True}})
        operator = self.folder / "operator.jwt"
        operator.write_text(key.token(key, "operator", {}), encoding="ascii")
        self.configuration = f'operator: "{operator}"\nresolver: MEMORY\nresolver_preload: {{ {self.account.public}: {account} }}\n'

    def user(self, name, publish, subscribe):
        """The .creds file of a user who may do that."""
        key = Key(self.folder, "user", name)
        claims = {"pub": {"allow": publish}, "sub": {"allow": subscribe}, "subs": -1, "data": -1, "payload": -1}
        token = self.account.token(key, name, claims)
        file = self.folder / f"{name}.creds"
        file.touch(0o600)
        file.write_text(
            f"-----BEGIN NATS USER JWT-----\n{token}\n------END NATS USER JWT------\n\n"
            f"-----BEGIN USER NKEY SEED-----\n{key.seed}\n------END USER NKEY SEED------\n",
            encoding="ascii",
        )
        return file
