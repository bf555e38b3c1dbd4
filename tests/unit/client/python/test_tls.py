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


def test_who_is_not_let_in_is_told_what_to_try(start_daemon, certificate, tmp_path):
    cert, key = certificate
    encrypted = start_daemon("--tls-cert", cert, "--tls-key", key).tcp()
    plain = start_daemon().tcp()
    other = tmp_path / "other.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days",
                    "1", "-subj", "/CN=other", "-keyout", tmp_path / "other.key", "-out", other], check=True, stderr=subprocess.DEVNULL)
    for address, security, hint in (
            (encrypted, Security(), r"does it want TLS\? Then give its CA \(Security\.ca_file\)"),
            (encrypted, Security(ca_file=str(other), server_name="warmfront.test"), r"is Security\.ca_file the CA that signed its"),
            (encrypted, Security(ca_file=cert), r"give a name that its certificate has \(Security\.server_name\)"),
            (plain, Security(ca_file=cert), "does it speak TLS\\? Leave the CA out where it does not")):
        with pytest.raises(warmfront.UnavailableError, match=hint):
            warmfront.connect(address, security=security, timeouts=Timeouts(call=1))


def test_files_that_are_no_pem_are_refused_at_once(certificate):
    cert, key = certificate
    for security, what in ((Security(ca_file=key), f"CA file {key}: has no CERTIFICATE in PEM format"),
                           (Security(ca_file=__file__), f"CA file {__file__}: has no CERTIFICATE in PEM format"),
                           (Security(cert_file=cert, key_file=cert), f"key file {cert}: has no PRIVATE KEY in PEM format"),
                           (cert, "security: a str; give a Security")):
        with pytest.raises(warmfront.InvalidArgumentError, match=what):
            warmfront.connect("127.0.0.1:1", security=security)
    with pytest.raises(warmfront.InvalidArgumentError, match="timeouts: a int; give a Timeouts"):
        warmfront.connect("127.0.0.1:1", timeouts=3)
