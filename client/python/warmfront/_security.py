# SPDX-License-Identifier: Apache-2.0
"""A client's credentials from files, and what to try where they and the daemon's do not fit. Thread-safe."""
from __future__ import annotations

import re
from typing import NamedTuple, Optional

import grpc

from .errors import InvalidArgumentError
from .options import Security

_CERTIFICATE = "CERTIFICATE"
_PRIVATE_KEY = "PRIVATE KEY"


class Credentials(NamedTuple):
    channel: Optional[grpc.ChannelCredentials]  # None: not encrypted
    authorization: str  # the metadata's value; empty without a token


def read_credentials(address: str, security: Security) -> Credentials:
    """InvalidArgumentError for files that cannot be read or are no PEM, a certificate without its key or the reverse, and a
    token that would be sent in the clear to another machine."""
    if not isinstance(security, Security):
        raise InvalidArgumentError(f"security: a {type(security).__name__}; give a Security(ca_file=...)")
    if bool(security.cert_file) != bool(security.key_file):
        raise InvalidArgumentError("a client certificate needs its key, and a key its certificate: state both files")
    encrypted = bool(security.tls or security.ca_file or security.cert_file)
    authorization = _authorization(address, security, encrypted)
    if not encrypted:
        return Credentials(None, authorization)
    return Credentials(grpc.ssl_channel_credentials(
        _read_pem("CA file", security.ca_file, _CERTIFICATE), _read_pem("key file", security.key_file, _PRIVATE_KEY),
        _read_pem("certificate file", security.cert_file, _CERTIFICATE)), authorization)


def what_to_try(why: str, encrypted: bool) -> str:
    """Where no connection came about, by gRPC's words."""
    if not encrypted:  # a daemon with TLS takes such a connection, and closes it
        closed = why.endswith(("Socket closed", "Connection reset by peer"))
        return "does it want TLS? Then give its CA (Security.ca_file)" if closed else "is it running there?"
    for said, hint in (
            ("certificate verify failed", "is Security.ca_file the CA that signed its certificate?"),
            ("is not in peer certificate", "give a name that its certificate has (Security.server_name)"),
            ("wrong version number", "does it speak TLS? Leave the CA out where it does not")):
        if said in why:
            return hint
    return "is it running there?"


def _read(what: str, path: str) -> Optional[bytes]:
    """The file's content; None for no file."""
    if not path:
        return None
    try:
        with open(path, "rb") as file:
            content = file.read()
    except OSError as error:
        raise InvalidArgumentError(f"{what} {path}: it cannot be read ({error.strerror})") from None
    if not content:
        raise InvalidArgumentError(f"{what} {path}: it is empty")
    return content


def _read_pem(what: str, path: str, holds: str) -> Optional[bytes]:
    content = _read(what, path)
    if content is not None and not re.search(rb"-----BEGIN [A-Z0-9 ]*" + holds.encode() + rb"-----", content):
        raise InvalidArgumentError(f"{what} {path}: has no {holds} in PEM format")
    return content


def _authorization(address: str, security: Security, encrypted: bool) -> str:
    content = _read("token file", security.token_file)
    if content is None:
        return ""
    token = content.decode("utf-8", "replace").strip()
    if not token or len(token.split()) != 1:
        raise InvalidArgumentError(f"token file {security.token_file}: one token is expected, and nothing else")
    if not encrypted and not re.match(r"unix:|localhost:|\[::1\]:|127\.", address):
        raise InvalidArgumentError(f"the token would travel to {address} in the clear; use TLS")
    return f"Bearer {token}"
