"""The dashboard answers its own page and nobody else: Host, Origin and token, at pages and at WebSockets."""

from __future__ import annotations

import asyncio
import gzip
import http.client
import logging
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path
from typing import Any

import pytest
import viser
import websockets.asyncio.server as websockets_server
from sample_logs import write_toy_log
from websockets.asyncio.client import connect
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin, Subprotocol

from dashboards.resources import resource
from dashboards.viser_app import guarded_server as guarded_module
from dashboards.viser_app.access import (
    Access,
    BadToken,
    Granted,
    Refused,
    TokenGiven,
    TokenRequired,
    is_loopback,
    same_origin,
    token_for_a_run,
)
from dashboards.viser_app.guarded_server import CannotGuard, guarded_server
from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard

TOKEN = "a-token-of-this-test"
LIOS = Path(sys.executable).with_name("lios")
HOST = "127.0.0.1:8080"
VISER = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap")


@pytest.fixture(scope="module")
def dashboard(log: Path) -> Iterator[Dashboard]:
    made = open_dashboard([log], port=0)
    yield made
    made.stop()


def judged(path: str = "/", *, access: Access | None = None, page: bool = False, **fields: str) -> Any:
    headers = Headers({"Host": HOST} | {name.replace("_", "-"): value for name, value in fields.items()})
    return (access or Access(host="127.0.0.1", token=TOKEN)).judge(path, headers, page=page)


def with_cookie(**fields: str) -> dict[str, str]:
    return {"Cookie": f"other=1; lios-dashboard-8080={TOKEN}"} | fields


def test_cookie_or_address_opens_a_websocket() -> None:
    assert isinstance(judged(**with_cookie()), Granted)
    assert isinstance(judged(f"/?token={TOKEN}"), Granted)
    assert isinstance(judged(**with_cookie(Origin=f"http://{HOST}")), Granted)


@pytest.mark.parametrize(
    ("path", "cookie"),
    [
        ("/", ""),
        ("/?token=", ""),
        ("/?token=wrong", ""),
        (f"/?token={TOKEN}x", ""),
        (f"/?token={TOKEN[:-1]}", ""),
        ("/?token=%C3%A4%00", ""),
        ("/", "lios-dashboard-8080=wrong"),
        ("/", f"lios-dashboard-8081={TOKEN}"),
        ("/?token=wrong", f"lios-dashboard-8080={TOKEN}"),
        (f"/{TOKEN}", ""),
        (f"/#token={TOKEN}", ""),
    ],
)
@pytest.mark.parametrize("page", [True, False])
def test_a_token_that_is_missing_or_wrong_is_refused(path: str, cookie: str, page: bool) -> None:
    verdict = judged(path, page=page, Cookie=cookie)
    assert isinstance(verdict, Refused)
    assert verdict.status == HTTPStatus.FORBIDDEN
    assert "token" in verdict.words
    assert TOKEN not in verdict.words


def test_a_page_gives_the_token_away_for_a_cookie_and_keeps_the_view() -> None:
    verdict = judged(f"/?runs=1,2&token={TOKEN}&at=3.5&item=a%26b", page=True)
    assert verdict == TokenGiven(query="runs=1,2&at=3.5&item=a%26b", cookie="lios-dashboard-8080")
    assert TOKEN not in verdict.query


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "https://evil.example",
        "http://127.0.0.1:9999",
        "http://127.0.0.1",
        "http://localhost:8080",
        "http://127.0.0.1:8080.evil.example",
        "http://evil@127.0.0.1:8080",
        "file://",
        "null",
        "",
        "chrome-extension://abc",
    ],
)
@pytest.mark.parametrize("token", [TOKEN, None])
def test_another_origin_is_refused_with_the_right_token_too(origin: str, token: str | None) -> None:
    access = Access(host="127.0.0.1", token=token)
    for page in (True, False):
        verdict = judged(f"/?token={TOKEN}", access=access, page=page, **with_cookie(Origin=origin))
        assert isinstance(verdict, Refused)
        assert "website" in verdict.words


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:8080",
        "localhost.evil.example:8080",
        "127.0.0.1.evil.example:8080",
        "0.0.0.0:8080",
        "192.168.1.5:8080",
        "127.0.0.1:8080@evil.example",
        "",
        "a b",
    ],
)
@pytest.mark.parametrize("token", [TOKEN, None])
def test_a_name_that_was_pointed_at_this_machine_is_refused(host: str, token: str | None) -> None:
    """DNS rebinding: the page's origin and Host agree, and are the attacker's."""
    access = Access(host="127.0.0.1", token=token)
    headers = Headers({"Host": host, "Origin": f"http://{host}", "Cookie": f"lios-dashboard-8080={TOKEN}"})
    assert isinstance(access.judge(f"/?token={TOKEN}", headers, page=False), Refused)


@pytest.mark.parametrize("hosts", [[], [HOST, HOST], [HOST, "evil.example"]])
def test_one_host_is_named_exactly_once(hosts: list[str]) -> None:
    headers = Headers([("Host", host) for host in hosts] + [("Cookie", f"lios-dashboard-8080={TOKEN}")])
    assert isinstance(Access(host="127.0.0.1", token=TOKEN).judge("/", headers, page=False), Refused)


def test_this_machine_is_known_by_its_names_and_through_a_forwarded_port() -> None:
    access = Access(host="127.0.0.1", token=TOKEN)
    for host in ("localhost:8080", "LOCALHOST:9000", "[::1]:8080", "127.0.0.2", HOST):
        headers = Headers({"Host": host, "Origin": f"http://{host}"})
        assert isinstance(access.judge(f"/?token={TOKEN}", headers, page=False), Granted), host


def test_where_others_can_connect_addresses_and_own_names_count() -> None:
    access = Access(host="0.0.0.0", token=TOKEN)
    for host in ("192.168.1.5:8080", "[fd00::1]:8080", "localhost:8080"):
        assert isinstance(access.judge(f"/?token={TOKEN}", Headers({"Host": host}), page=False), Granted)
    assert isinstance(access.judge(f"/?token={TOKEN}", Headers({"Host": "evil.example"}), page=False), Refused)


@pytest.mark.parametrize(
    "query", ["websocket=ws://evil.example", "%77ebsocket=x", "playbackPath=data:,x", "at=1&websocket="]
)
def test_an_address_that_leads_the_page_to_another_server_is_refused(query: str) -> None:
    for access in (Access(host="127.0.0.1", token=TOKEN), Access(host="127.0.0.1", token=None)):
        assert isinstance(judged(f"/?{query}", access=access, page=True, **with_cookie()), Refused)
        assert isinstance(judged(f"/?token={TOKEN}&{query}", access=access, page=True), Refused)


def test_an_endless_query_is_refused() -> None:
    assert isinstance(judged("/?" + "a=1&" * 1000, **with_cookie()), Refused)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "", "192.0.2.1", "no.such.name.invalid"])
def test_without_a_token_only_this_machine_is_served(host: str, log: Path) -> None:
    with pytest.raises(TokenRequired, match="--no-token"):
        Access(host=host, token=None)
    with pytest.raises(TokenRequired):
        open_dashboard([log], host=host, port=0, token=False)


@pytest.mark.ci
def test_the_command_refuses_an_open_dashboard_in_one_line(log: Path) -> None:
    words = ["view", str(log), "--host", "0.0.0.0", "--no-token", "--port", "0"]
    done = subprocess.run([LIOS, *words], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "--no-token with --host 0.0.0.0" in done.stderr
    assert "Traceback" not in done.stderr


def test_loopback_is_told_by_where_a_name_leads() -> None:
    assert all(is_loopback(host) for host in ("127.0.0.1", "127.1.2.3", "::1", "localhost"))
    assert not any(is_loopback(host) for host in ("0.0.0.0", "::", "", "10.0.0.1"))


def test_default_ports_are_left_out_by_browsers() -> None:
    assert same_origin("http://localhost", "localhost:80")
    assert same_origin("https://robot.local", "robot.local:443")
    assert not same_origin("https://localhost", "localhost:80")


def test_tokens_are_long_and_new(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LIOS_DASHBOARD_TOKEN", raising=False)
    tokens = {token_for_a_run() for _ in range(100)}
    assert len(tokens) == 100
    assert min(len(token) for token in tokens) >= 32


@pytest.mark.parametrize(
    "chosen", ["short", "x" * 15, "a token with spaces in it", "x" * 300, "ä" * 20, "a" * 20 + ";b"]
)
def test_a_chosen_token_that_could_be_guessed_or_breaks_a_cookie_is_refused(
    monkeypatch: pytest.MonkeyPatch, chosen: str
) -> None:
    monkeypatch.setenv("LIOS_DASHBOARD_TOKEN", chosen)
    with pytest.raises(BadToken, match="LIOS_DASHBOARD_TOKEN") as refused:
        token_for_a_run()
    assert chosen not in str(refused.value)


def test_a_chosen_token_stays_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_DASHBOARD_TOKEN", "kiosk-in-the-lab_1")
    assert token_for_a_run() == "kiosk-in-the-lab_1"


def test_the_token_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    from dashboards.viser_app import access as access_module

    compared: list[tuple[bytes, bytes]] = []

    def compare(a: bytes, b: bytes) -> bool:
        compared.append((a, b))
        return a == b

    monkeypatch.setattr(access_module.hmac, "compare_digest", compare)
    judged("/?token=wrong")
    judged(**with_cookie())
    assert compared == [(b"wrong", TOKEN.encode()), (TOKEN.encode(), TOKEN.encode())]
    assert TOKEN not in repr(Access(host="127.0.0.1", token=TOKEN))


# What follows talks to a running server.


def asked(dashboard: Dashboard, path: str = "/", **fields: str) -> tuple[int, dict[str, str], str]:
    port = dashboard.server.get_port()
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.request("GET", path, headers={"Host": f"127.0.0.1:{port}"} | fields)
    answer = connection.getresponse()
    body = answer.read().decode("utf-8", "replace")
    connection.close()
    return answer.status, {name.lower(): value for name, value in answer.getheaders()}, body


def opened(dashboard: Dashboard, *, query: str = "", origin: str | None = None, host: str = "", **fields: str) -> int:
    """What a WebSocket's handshake was answered with; 101 once the server has sent its first message."""
    port = dashboard.server.get_port()

    async def attempt() -> int:
        try:
            async with connect(
                f"ws://{host or '127.0.0.1'}:{port}/{query}",
                host="127.0.0.1",
                port=port,
                origin=None if origin is None else Origin(origin),
                additional_headers=fields,
                subprotocols=[VISER],
                max_size=None,
                compression=None,
                proxy=None,
            ) as socket:
                assert await asyncio.wait_for(socket.recv(), 20)
                return 101
        except InvalidStatus as refused:
            return refused.response.status_code

    return asyncio.run(attempt())


def test_pages_are_given_for_the_token_only(dashboard: Dashboard) -> None:
    status, headers, body = asked(dashboard)
    assert (status, "html" in body.lower()) == (403, False)
    status, headers, body = asked(dashboard, f"/?token={dashboard.token}&at=2")
    assert status == 200
    assert "./?at=2" in body
    assert str(dashboard.token) not in body
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert headers["referrer-policy"] == "no-referrer"
    status, headers, body = asked(dashboard, "/?at=2", Cookie=cookie.partition(";")[0])
    assert status == 200
    assert "Viser" in body
    assert headers["referrer-policy"] == "no-referrer"
    assert "connect-src 'self'" in headers["content-security-policy"]


def test_a_websocket_is_opened_for_the_own_page_only(dashboard: Dashboard) -> None:
    port, token = dashboard.server.get_port(), dashboard.token
    own, cookie = f"http://127.0.0.1:{port}", f"lios-dashboard-{port}={token}"
    assert opened(dashboard, Cookie=cookie, origin=own) == 101
    assert opened(dashboard, query=f"?token={token}") == 101
    assert opened(dashboard, origin=own) == 403
    assert opened(dashboard, query="?token=wrong", origin=own) == 403
    assert opened(dashboard, Cookie=cookie, origin="http://evil.example") == 403
    assert opened(dashboard, Cookie=cookie, host="evil.example", origin=f"http://evil.example:{port}") == 403


def test_without_a_token_other_origins_and_hosts_are_refused_all_the_same(log: Path) -> None:
    made = open_dashboard([log], port=0, token=False)
    try:
        assert made.link("at=1") == f"{made.url}/?at=1"
        assert asked(made)[0] == 200
        assert opened(made, origin=made.url) == 101
        assert opened(made, origin="http://evil.example") == 403
        assert opened(made, host="evil.example") == 403
    finally:
        made.stop()


def test_the_token_is_in_no_log_however_loud(log: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG):
        made = open_dashboard([log], port=0)
        try:
            asked(made, f"/?token={made.token}")
            opened(made, query=f"?token={made.token}")
            opened(made, query=f"?token={made.token}", origin="http://evil.example")
        finally:
            made.stop()
        assert made.token
        assert made.token not in "\n".join(
            record.getMessage() for record in caplog.records if record.name != "websockets.client"
        )
    assert made.token not in repr(made)


def test_a_viser_that_goes_past_the_checks_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[bool] = []

    class Unguarded:
        def __init__(self, **_: Any) -> None: ...

        def stop(self) -> None:
            stopped.append(True)

    monkeypatch.setattr(guarded_module.viser, "ViserServer", Unguarded)
    with pytest.raises(CannotGuard):
        guarded_server(Access(host="127.0.0.1", token=TOKEN), port=0, label="x")
    assert stopped == [True]


def test_servers_of_others_are_left_as_they_are() -> None:
    before = websockets_server.serve
    made = guarded_server(Access(host="127.0.0.1", token=TOKEN), port=0, label="x")
    made.stop()
    assert websockets_server.serve is before


@pytest.mark.parametrize(("near", "encoding"), [(False, "gzip"), (False, "identity"), (True, "identity")])
def test_our_script_runs_before_visers_and_pages_are_packed_for_others_only(
    dashboard: Dashboard, near: bool, encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dashboards.viser_app.guarded_server.is_loopback", lambda _host: near)
    asked = "gzip" if near else encoding
    for _ in range(2):  # the second time from memory
        request = urllib.request.Request(dashboard.url, headers={"Accept-Encoding": asked})
        request.add_header("Cookie", f"lios-dashboard-{dashboard.server.get_port()}={dashboard.token}")
        with urllib.request.urlopen(request, timeout=30) as answer:
            body = answer.read()
            assert int(answer.headers["Content-Length"]) == len(body)
            assert answer.headers["Content-Encoding"] == encoding
            page = (gzip.decompress(body) if encoding == "gzip" else body).decode()
        assert page.index("<script") == page.index("<script>" + resource("viser_app/head.js"))
