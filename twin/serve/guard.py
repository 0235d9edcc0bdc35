"""What stands before every answer: only reading, no host name of others, a token, strict headers."""

from __future__ import annotations

import hmac
from collections.abc import Collection
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from urllib.parse import parse_qs

from starlette.datastructures import MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE = "twin_token"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
    "cache-control": "no-store",
}


class Guard:
    """Wraps an application. token None: whoever reaches the port may read."""

    def __init__(self, app: ASGIApp, token: str | None, names: Collection[str]):
        """names: of this computer, that a browser may ask for beside numbers and localhost."""
        self.app, self.token = app, token
        self.names = {name.lower().rstrip(".") for name in names}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
            await send(message)

        await (self._refusal(scope) or self.app)(scope, receive, sent)

    def _refusal(self, scope: Scope) -> ASGIApp | None:
        headers = dict(scope["headers"])
        if scope["method"] not in ("GET", "HEAD"):
            return PlainTextResponse("This server is only read.\n", 405, {"allow": "GET, HEAD"})
        if not self._known(headers.get(b"host", b"").decode("latin-1")):
            return PlainTextResponse("No page for this host name; see `twin serve --name`.\n", 421)
        if self.token is None:
            return None
        if self._same(parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]):
            answer = RedirectResponse("/", 303)  # the token leaves the address bar; never to where a path says
            encrypted = scope["scheme"] == "https"
            answer.set_cookie(COOKIE, self.token, httponly=True, samesite="strict", path="/", secure=encrypted)
            return answer
        if self._same(_bearer(headers)) or self._same(_cookie(headers)):
            return None
        words = "A token is needed: open the address that `twin serve` printed.\n"
        return PlainTextResponse(words, 401, {"www-authenticate": "Bearer"})

    def _known(self, host: str) -> bool:
        """An address in numbers cannot be rebound to another one, a name can: only our own."""
        name = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
        name = name.lower().rstrip(".")
        if name == "localhost" or name in self.names:
            return True
        try:
            ip_address(name)
        except ValueError:
            return False
        return True

    def _same(self, given: str) -> bool:
        """In a time that does not depend on where they differ."""
        return hmac.compare_digest(given.encode("utf-8", "replace"), (self.token or "").encode("utf-8"))


def _bearer(headers: dict[bytes, bytes]) -> str:
    kind, _, value = headers.get(b"authorization", b"").decode("latin-1").partition(" ")
    return value.strip() if kind.lower() == "bearer" else ""


def _cookie(headers: dict[bytes, bytes]) -> str:
    try:
        morsel = SimpleCookie(headers.get(b"cookie", b"").decode("latin-1")).get(COOKIE)
    except CookieError:
        return ""
    return morsel.value if morsel else ""
