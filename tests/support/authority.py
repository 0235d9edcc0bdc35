"""Certificates for tests of encrypted connections."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID


def authority(folder: Path, name: str) -> None:
    """A certificate authority, NAME.pem, and a certificate by it of 127.0.0.1, NAME-host.pem, with its key."""
    now = datetime.now(UTC)

    def written(stem, subject, issuer, public, signer, extension):
        made = (
            x509.CertificateBuilder()
            .subject_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, subject)]))
            .issuer_name(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, issuer)]))
            .public_key(public).serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(days=1)).not_valid_after(now + timedelta(days=1))
            .add_extension(extension, critical=False).sign(signer, hashes.SHA256())
        )  # fmt: skip
        (folder / f"{stem}.pem").write_bytes(made.public_bytes(serialization.Encoding.PEM))

    root, own = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
    written(name, name, name, root.public_key(), root, x509.BasicConstraints(ca=True, path_length=None))
    address = x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))])
    written(f"{name}-host", "host", name, own.public_key(), root, address)
    (folder / f"{name}-host.key").write_bytes(
        own.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
