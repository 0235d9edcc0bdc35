"""The server: read by those who may, and by nothing else."""

from __future__ import annotations

import http.client
import json
import shutil
import socket
import ssl
from urllib.parse import urlsplit

import pytest

from twin.cli.main import run

pytest.importorskip("starlette")
pytest.importorskip("cryptography")

from tests.support.authority import authority
from twin.serve.guard import Guard

TOKEN = "a token of the tests 123"


def test_a_finished_run_is_served_and_only_read(server, slide_artefact, slide_result):
    one = server(str(slide_artefact), str(slide_result))
    page = one.ask("/")
    assert page.status == 200
    for name, value in (
        ("Content-Security-Policy", "default-src 'none'"), ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"), ("Cache-Control", "no-store"),
    ):  # fmt: skip
        assert value in page.headers[name]
    assert json.loads(one.ask("/content.json").body)["mode"] == "finished"
    assert one.ask("/result.h5").body == (slide_result / "result.h5").read_bytes()
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
        assert one.ask("/content.json", method).status == 405
    assert one.ask("/", "HEAD").body == b""
    for path in (
        "/now.json",
        "/../pyproject.toml",
        "/%2e%2e/pyproject.toml",
        "/vendor/",
        "/frame/1.json",
        "/result.h5/x",
    ):
        assert one.ask(path).status == 404
    assert one.ask("/", Host="evil.example").status == 421
    assert one.ask("/nothing").headers["Content-Security-Policy"] == page.headers["Content-Security-Policy"]
    assert one.stop() == 0


def test_a_token_opens_the_page_and_nothing_else_does(server, slide_artefact, slide_result, shown):
    one = server(str(slide_artefact), str(slide_result), "--token", TOKEN)
    assert one.ask("/").status == one.ask("/content.json").status == 401
    assert one.ask("/?token=wrong").status == 401
    assert one.ask("/", Authorization="Bearer wrong").status == one.ask("/", Cookie="twin_token=wrong").status == 401
    assert one.ask("/", Cookie="a;;=\x7f").status == 401
    assert one.ask("/", Authorization=f"Bearer {TOKEN}").status == 200
    sent = one.ask(f"/?token={TOKEN.replace(' ', '+')}")
    assert (sent.status, sent.headers["Location"]) == (303, "/")
    assert one.ask(f"//evil.example/?token={TOKEN.replace(' ', '+')}").headers["Location"] == "/"
    assert "HttpOnly" in sent.headers["Set-Cookie"]
    assert "SameSite=strict" in sent.headers["Set-Cookie"]
    page = shown().open(one.url.replace(" ", "+"))
    assert "token" not in page.tab.url
    assert page.colours("#surface-canvas") > 50
    assert page.wrong == []
    assert all(url.startswith((one.url.partition("?")[0], "data:", "blob:")) for url in page.asked)


def test_beyond_this_computer_a_token_is_made(server, slide_artefact, slide_result):
    one = server(str(slide_artefact), str(slide_result), "--host", "0.0.0.0")
    token = one.url.partition("?token=")[2]
    assert len(token) > 40
    assert one.ask("/").status == 401
    assert one.ask("/", Authorization=f"Bearer {token}").status == 200


@pytest.mark.parametrize(
    ("host", "known"),
    [("127.0.0.1:80", True), ("[::1]:80", True), ("localhost", True), ("10.1.2.3", True), ("Mill.:80", True),
     ("mill.example", False), ("", False), ("127.0.0.1.nip.io", False), ("[mill]", True), ("localhost.evil", False)],
)  # fmt: skip
def test_only_own_names_and_numbers_are_hosts(host, known):
    guard = Guard(lambda *_: None, None, ("mill",))  # type: ignore[arg-type, return-value]
    assert guard._known(host) is known


@pytest.mark.long
def test_a_running_machine_is_followed(server, slide_artefact, state, tmp_path, shown):
    folder = shutil.copytree(state, tmp_path / "state")
    one = server(str(slide_artefact), "--live", str(folder))
    told = json.loads(one.ask("/now.json?after=-1").body)
    (row,) = told["rows"]
    health = json.loads((folder / "health.json").read_text())
    assert row["temperature"] == list(health["model"]["temperatures_degC"].values())
    assert one.ask(f"/frame/{row['step']}.json").status == 200
    assert one.ask("/frame/999.json").status == 404
    assert one.ask("/now.json?after=x").status == 400
    assert "it has stopped, or hangs" in told["trust"]["line"] or told["trust"]["level"] in ("yes", "care")
    page = shown(390, 844).open(one.url)
    page.until("page.store.length === 1")
    step = json.loads((folder / "step.json").read_text())
    step |= {"step": step["step"] + 1, "time": step["time"] + 60.0, "states": [1.05 * x for x in step["states"]]}
    (folder / ".part").write_text(json.dumps(step))
    (folder / ".part").replace(folder / "step.json")
    page.until("page.store.length === 2 && page.store.frame.row === 1")
    assert page.colours("#surface-canvas") > 50
    assert page.do("document.querySelectorAll('#health-table tr').length") > 5
    assert page.do("document.documentElement.scrollWidth") <= 390
    assert page.wrong == []
    one.stop()
    page.until("document.getElementById('trust').textContent.includes('does not answer')")


def test_what_cannot_be_served_is_told(slide_artefact, slide_result, tmp_path, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for arguments, words in (
            (["--port", port, str(slide_result)], "cannot listen"),
            (["--token", "short", str(slide_result)], "can be guessed"),
            ([str(tmp_path)], "no result here"),
            ([], "one of OUTPUT and --live is needed"),
            (["--live", str(tmp_path / "none")], "no such folder"),
            ([str(slide_result), "--live", str(tmp_path)], "one of OUTPUT and --live is needed"),
            (["--host", "no.such.host.example", str(slide_result)], "cannot listen"),
            (["--opcua", "http://127.0.0.1", str(slide_result)], "no address of an OPC UA server"),
            (["--opcua", "opc.tcp://127.0.0.1:4840", "--password-file", str(tmp_path / "no"), str(slide_result)],
             "cannot read"),
        ):  # fmt: skip
            assert run(["serve", str(slide_artefact), *arguments]) == 2
            assert words in capsys.readouterr().err


@pytest.mark.long
def test_a_state_of_another_artefact_is_refused(slide_artefact, state, tmp_path, capsys):
    folder = shutil.copytree(state, tmp_path / "state")
    told = json.loads((folder / "health.json").read_text()) | {"artefact": "0" * 64}
    (folder / "health.json").write_text(json.dumps(told))
    assert run(["serve", str(slide_artefact), "--live", str(folder)]) == 2
    assert "another artefact" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "other"}', '{"format": "twin live step"}'])
def test_damaged_files_of_the_state_are_waited_out(slide_artefact, state, tmp_path, text):
    from twin.rom.artefact import read_artefact
    from twin.serve.live_state import LiveState

    folder = shutil.copytree(state, tmp_path / "state")
    (folder / "step.json").write_text(text)
    live = LiveState(read_artefact(slide_artefact), folder)
    assert live.told(-1)["rows"] == []
    shutil.copy(state / "step.json", folder / "step.json")
    assert len(live.told(-1)["rows"]) == 1


def test_the_page_goes_encrypted_where_a_certificate_is_given(server, slide_artefact, slide_result, tmp_path, capsys):
    authority(tmp_path, "plant")
    given = ["--certificate", str(tmp_path / "plant-host.pem"), "--key", str(tmp_path / "plant-host.key")]
    one = server(str(slide_artefact), str(slide_result), "--token", TOKEN, *given)
    assert one.url.startswith("https://127.0.0.1:")
    place = urlsplit(one.url)
    trusted = ssl.create_default_context(cafile=str(tmp_path / "plant.pem"))
    connection = http.client.HTTPSConnection("127.0.0.1", place.port, context=trusted, timeout=30)
    connection.request("GET", f"/?token={TOKEN.replace(' ', '+')}")
    answer = connection.getresponse()
    assert answer.status == 303
    assert "Secure" in answer.headers["Set-Cookie"]
    with pytest.raises(ssl.SSLCertVerificationError):
        http.client.HTTPSConnection("127.0.0.1", place.port, timeout=30).request("GET", "/")
    with pytest.raises((http.client.HTTPException, OSError)):
        one.ask("/")  # not encrypted
    for wrong in (given[:2], [*given[:3], str(tmp_path / "plant-host.pem")], [given[0], "none.pem", *given[2:]]):
        assert run(["serve", str(slide_artefact), str(slide_result), *wrong]) == 2
        assert "certificate" in capsys.readouterr().err
