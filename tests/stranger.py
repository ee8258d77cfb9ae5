"""What somebody on the same network can try without a certificate: `python -m tests.stranger`.

Prints as JSON what came of each attempt; everything must be empty.
"""

import json
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import zenoh

from schemas import topics
from schemas.topics import ALL_QUERIES, ALL_TOPICS, full_key

patience_s = 1.0
port = 7447


def attempts(address: str, realm: str, robot: str, folder: Path) -> dict[str, Any]:
    forged = forge(folder)
    ways = {
        "plain": (f"tcp/{address}:{port}", {}),
        "tls without a certificate": (f"tls/{address}:{port}", {}),
        "tls with a forged certificate": (f"tls/{address}:{port}", forged),
        "quic": (f"quic/{address}:{port}", forged),
        "udp": (f"udp/{address}:{port}", {}),
    }
    found: dict[str, Any] = {"scouting": scouted()}
    for way, (endpoint, tls) in ways.items():
        found[f"connect, {way}"] = connects(endpoint, tls)
        for mode in ("peer", "client", "router"):
            heard = everything(mode, endpoint, tls, realm, robot)
            found |= {f"{what}, {mode}, {way}": result for what, result in heard.items()}
    found["speech to the port"] = spoken(address)
    return found


def forge(folder: Path) -> dict[str, Any]:
    """An own authority and a certificate in the operator's name."""
    key, certificate = folder / "key.pem", folder / "cert.pem"
    command = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 1"
    names = ["-subj", "/CN=operator", "-addext", "subjectAltName=IP:10.77.0.1"]
    made = [*command.split(), *names, "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(made, check=True, capture_output=True)
    return {
        "transport/link/tls/root_ca_certificate": str(certificate),
        "transport/link/tls/connect_private_key": str(key),
        "transport/link/tls/connect_certificate": str(certificate),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": False,
    }


def scouted() -> list[str]:
    """Who answers to a call on the network."""
    answers: list[str] = []
    scout = zenoh.scout(lambda hello: answers.append(str(hello)), what="peer|router|client")
    time.sleep(2 * patience_s)
    scout.stop()
    return answers


def config(mode: str, endpoint: str, tls: dict[str, Any]) -> zenoh.Config:
    made = zenoh.Config()
    settings = {"mode": mode, "connect/endpoints": [endpoint], "connect/timeout_ms": 500, **tls}
    for key, value in settings.items():
        made.insert_json5(key, json.dumps(value))
    return made


def connects(endpoint: str, tls: dict[str, Any]) -> list[str]:
    try:
        with zenoh.open(config("client", endpoint, tls)) as session:
            return [str(session.info.zid())]
    except zenoh.ZError:
        return []


def everything(
    mode: str, endpoint: str, tls: dict[str, Any], realm: str, robot: str
) -> dict[str, list[str]]:
    """Subscribe, publish, ask, and look for who is there."""
    try:
        session = zenoh.open(config(mode, endpoint, tls))
    except zenoh.ZError:
        return {}
    heard: list[str] = []
    own = {full_key(realm, robot, topic.key) for topic in ALL_TOPICS}
    with session:
        session.declare_subscriber("**", lambda sample: heard.append(str(sample.key_expr)))
        time.sleep(patience_s)
        asked = [full_key(realm, robot, query.key) for query in ALL_QUERIES]
        answers = [
            str(reply.ok.key_expr)
            for key in ("**", full_key(realm, robot, "last/*"), *asked)
            for reply in session.get(key, timeout=patience_s)
            if reply.ok
        ]
        alive = [
            str(reply.ok.key_expr)
            for reply in session.liveliness().get("**", timeout=patience_s)
            if reply.ok
        ]
        for topic in ALL_TOPICS:
            session.put(full_key(realm, robot, topic.key), b"\x80")
        session.delete(full_key(realm, robot, topics.STOP.key))
        time.sleep(patience_s)
        links = [str(link) for link in session.info.links()]
    # A session hears its own messages; nobody else's.
    others = [key for key in heard if key not in own]
    return {"hears": others, "answers": answers, "liveliness": alive, "links": links}


def spoken(address: str) -> str:
    """What the port says to somebody who does not speak its language."""
    with socket.create_connection((address, port), timeout=patience_s) as link:
        link.sendall(b"GET / HTTP/1.1\r\n\r\n")
        try:
            said = link.recv(1000)
        except (TimeoutError, ConnectionError):
            return ""
    # A TLS alert (0x15) tells that this is no TLS, and nothing more.
    return "" if said[:1] in (b"", b"\x15") else said.hex()


if __name__ == "__main__":
    at, of_realm, of_robot, own_folder = sys.argv[1:]
    print(json.dumps(attempts(at, of_realm, of_robot, Path(own_folder))))
