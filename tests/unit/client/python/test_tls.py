# SPDX-License-Identifier: Apache-2.0
"""TLS and mutual TLS, with certificates made by openssl for the test."""
import shutil
import subprocess

import pytest
from support import triangle_through_triangle

import warmfront
from warmfront import Timeouts, Security

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")


@pytest.fixture
def certificate(tmp_path):
    """Signed by itself, for the name `warmfront.test`."""
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days",
                    "1", "-subj", "/CN=warmfront.test", "-addext", "subjectAltName=DNS:warmfront.test", "-keyout",
                    tmp_path / "key.pem", "-out", tmp_path / "cert.pem"], check=True, stderr=subprocess.DEVNULL)
    return str(tmp_path / "cert.pem"), str(tmp_path / "key.pem")


def test_encrypted_and_known_to_each_other(start_daemon, certificate):
    cert, key = certificate
    before, after, faces = triangle_through_triangle()
    address = start_daemon("--tls-cert", cert, "--tls-key", key, "--tls-client-ca", cert).tcp()
    known = Security(ca_file=cert, cert_file=cert, key_file=key, server_name="warmfront.test")
    with warmfront.connect(address, security=known) as client, client.session(before, faces) as session:
        assert len(session.step(after)) == 3
    for unknown in (Security(ca_file=cert, server_name="warmfront.test"), Security(), Security(tls=True),
                    Security(ca_file=cert, cert_file=cert, key_file=key)):
        with pytest.raises(warmfront.UnavailableError):
            warmfront.connect(address, security=unknown, timeouts=Timeouts(call=1))


def test_who_does_not_encrypt_is_told_what_to_try(start_daemon, certificate):
    cert, key = certificate
    address = start_daemon("--tls-cert", cert, "--tls-key", key).tcp()
    with pytest.raises(warmfront.UnavailableError, match=r"does it want TLS\? Then give its CA \(Security\.ca_file\)"):
        warmfront.connect(address, timeouts=Timeouts(call=1))
