"""Access to the dashboard: checks of Host, Origin and token, as pure functions of one request's head.

A browser that shows a stranger's page will connect to servers of this machine for it. Three checks, all of which must
pass, stop that: Host against names that were pointed at this machine (DNS rebinding), Origin against pages other than
the dashboard's own, and a token that only who started the dashboard knows (other people on the same machine or in the
same network). The token comes in the address once and is handed over as a cookie, so that it is in no address bar,
no link and no Referer afterwards. Terms: RFC 9110 (Host), RFC 6454 (Origin), RFC 6265 (cookies), CSP Level 3.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import re
import secrets
import socket
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from http import HTTPStatus
from typing import Protocol
from urllib.parse import parse_qsl, urlencode, urlsplit

from workbench.errors import InputError

TOKEN_BYTES = 24
"""Of a token, before it is written in base64: as hard to guess as a key of 192 bits."""
TOKEN_VARIABLE = "LIOS_DASHBOARD_TOKEN"
"""Of the environment: a token that stays the same, so that open pages find a dashboard that was started again."""
MIN_LETTERS = 16
MAX_FIELDS = 100
"""Of an address's query; beyond it the request is refused."""
FOREIGN_FIELDS = ("websocket", "playbackPath")
"""Fields of an address that make Viser's page listen to another server: it could run scripts as ours."""

_AUTHORITY = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(?::(?P<port>[0-9]{1,5}))?", re.ASCII)
_DEFAULT_PORTS = {"http": "80", "https": "443"}


class BadToken(InputError):
    """The token that the environment names could be guessed, or does not fit into an address."""

    def __init__(self) -> None:
        super().__init__(
            f"{TOKEN_VARIABLE}: it needs at least {MIN_LETTERS} letters, digits, - or _. "
            "Unset it, and a token is made for each run."
        )


class TokenRequired(InputError):
    """Others could reach the address, and nothing would keep them out."""

    def __init__(self, host: str) -> None:
        super().__init__(
            f"--no-token with --host {host}: everyone in the network could look. Leave out --no-token, "
            "or listen on this machine only (--host 127.0.0.1)."
        )


class Fields(Protocol):
    """The header fields of a request."""

    def get_all(self, key: str, /) -> Sequence[str]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """The request gets no more than this answer."""

    status: HTTPStatus
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TokenGiven:
    """The address holds the right token: it becomes a cookie, and the page is asked for again without it.

    Attributes:
        query: of the address to go on to, without the token.
        cookie: the name of the cookie to set: browsers do not distinguish the ports of one machine, so it contains
            the port under which the browser knows the dashboard.
    """

    query: str
    cookie: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Granted:
    """The request may be answered."""


Verdict = Refused | TokenGiven | Granted


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """The rules of one running dashboard.

    Attributes:
        host: the address that it listens on, as it was given.
        token: what a visitor must know; None lets in all of this machine.

    Raises:
        TokenRequired: no token, and the address can be reached from other machines.
    """

    host: str
    token: str | None = field(repr=False)

    def __post_init__(self) -> None:
        if not is_loopback(self.host):
            if self.token is None:
                raise TokenRequired(self.host)
            _names_of_this_machine()  # Asked for now: a slow name server must not hold up a request.

    def judge(self, path: str, headers: Fields, *, page: bool) -> Verdict:
        """Whether one request may be answered.

        Args:
            path: the request's target, with its query.
            headers: its header fields.
            page: whether it asks for a page or a file; otherwise it opens a WebSocket.
        """
        hosts = headers.get_all("Host")
        if len(hosts) != 1 or not self._is_ours(hosts[0].strip().lower()):
            return _no("This is not an address of the dashboard. Use the one that it printed, or an IP address.")
        host = hosts[0].strip().lower()
        if not all(same_origin(origin, host) for origin in headers.get_all("Origin")):
            return _no("This request came from another website. Only the dashboard's own page is answered.")
        fields = _fields(path)
        if fields is None or any(key in FOREIGN_FIELDS for key, _ in fields):
            return _no("This address would connect the page to another server. Use the one that was printed.")
        if self.token is None:
            return Granted()
        cookie = _cookie_name(host)
        asked = [value for key, value in fields if key == "token"]
        if any(self._is_token(value) for value in asked):
            rest = urlencode([(key, value) for key, value in fields if key != "token"], safe=",")
            return TokenGiven(query=rest, cookie=cookie) if page else Granted()
        if not asked and any(self._is_token(value) for value in _cookies(headers, cookie)):
            return Granted()
        return _no("The token is missing or wrong. Open the whole address that lios printed when it started.")

    def _is_token(self, value: str) -> bool:
        """In a time that does not depend on how much of it is right."""
        return self.token is not None and hmac.compare_digest(value.encode(), self.token.encode())

    def _is_ours(self, authority: str) -> bool:
        """Whether a Host names this machine: a name that anyone could have registered does not."""
        found = _AUTHORITY.fullmatch(authority)
        if found is None:
            return False
        name = found["name"].strip("[]")
        if name in ("localhost", self.host.lower().strip("[]")):
            return True
        address = _ip(name)
        if is_loopback(self.host):
            return address is not None and address.is_loopback
        return address is not None or name in _names_of_this_machine()


def token_for_a_run() -> str:
    """The token that the environment names, or a new one; of letters that need no escaping in an address or a cookie.

    Raises:
        BadToken: the environment's is short or has other letters.
    """
    chosen = os.environ.get(TOKEN_VARIABLE, "")
    if not chosen:
        return secrets.token_urlsafe(TOKEN_BYTES)
    if re.fullmatch(rf"[A-Za-z0-9_-]{{{MIN_LETTERS},256}}", chosen, re.ASCII) is None:
        raise BadToken
    return chosen


@lru_cache(maxsize=1024)
def is_loopback(host: str) -> bool:
    """Whether only this machine can reach an address; a name counts where all that it stands for does."""
    try:
        found = {entry[4][0] for entry in socket.getaddrinfo(host or "0.0.0.0", None, type=socket.SOCK_STREAM)}
    except (OSError, UnicodeError):
        return False
    addresses = [_ip(str(address).partition("%")[0]) for address in found]
    return bool(addresses) and all(address is not None and address.is_loopback for address in addresses)


def same_origin(origin: str, host: str) -> bool:
    """Whether a page's origin is that of the server that it asks; "null" (sandboxed pages, files) is not.

    Args:
        origin: the field Origin, "http://127.0.0.1:8080".
        host: the field Host in small letters, "127.0.0.1:8080".
    """
    scheme, separator, authority = origin.strip().lower().partition("://")
    if not separator or scheme not in _DEFAULT_PORTS:
        return False
    page, asked = _AUTHORITY.fullmatch(authority), _AUTHORITY.fullmatch(host)
    if page is None or asked is None:
        return False
    usual = _DEFAULT_PORTS[scheme]
    return (page["name"], page["port"] or usual) == (asked["name"], asked["port"] or usual)


def _no(words: str) -> Refused:
    return Refused(status=HTTPStatus.FORBIDDEN, words=words)


def _fields(path: str) -> list[tuple[str, str]] | None:
    """The fields of an address as a browser reads them; None where there are too many."""
    try:
        return parse_qsl(urlsplit(path).query, keep_blank_values=True, max_num_fields=MAX_FIELDS)
    except ValueError:
        return None


def _cookie_name(host: str) -> str:
    found = _AUTHORITY.fullmatch(host)
    return f"lios-dashboard-{(found and found['port']) or 80}"


def _cookies(headers: Fields, name: str) -> list[str]:
    pairs = [pair.partition("=") for line in headers.get_all("Cookie") for pair in line.split(";")]
    return [value.strip() for key, _, value in pairs if key.strip() == name]


def _ip(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


@cache
def _names_of_this_machine() -> frozenset[str]:
    name = socket.gethostname().lower()
    return frozenset({name, f"{name}.local", socket.getfqdn().lower()} - {""})
