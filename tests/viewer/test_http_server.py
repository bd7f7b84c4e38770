"""The web server itself: who may ask, in which form, and what every answer carries."""

from __future__ import annotations

import http.client
import json
import socket
from contextlib import closing, suppress
from http import HTTPStatus

import pytest

from lippmann.errors import PictureError, UsageError
from lippmann.runtime.machine import is_loopback
from lippmann.viewer.http_server import WebServer
from lippmann.viewer.responses import RefusedError, Response, json_response


class Echo:
    """Answers with what it was asked."""

    def get(self, request):
        if request.path == "/secret":
            raise RefusedError(HTTPStatus.NOT_FOUND, "there is nothing here")
        if request.path == "/broken":
            raise PictureError("is damaged", where="a.png", fix="fetch it anew")
        if request.path == "/huge":
            raise MemoryError
        if request.path == "/fault":
            raise ZeroDivisionError("a fault")
        return json_response({"path": request.path})

    def post(self, request, body):
        return Response(body, "application/json")


@pytest.fixture(scope="module")
def server():
    with WebServer(Echo()) as running:
        yield running


def ask(server, path="/", method="GET", headers=None, body=None):
    """Status, headers and body of one request, sent just as it is said."""
    named = {"Host": f"127.0.0.1:{server.port}", **(headers or {})}
    if body is not None:
        named.setdefault("Content-Length", str(len(body)))
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in named.items() if value is not None)]
    with socket.create_connection(("127.0.0.1", server.port), timeout=10) as connection:
        # At once: a body that comes after a refusal would reset the connection, and the answer might be lost.
        connection.sendall("\r\n".join([*lines, "", ""]).encode("latin-1") + (body or b""))
        answer = http.client.HTTPResponse(connection, method=method)
        answer.begin()
        return answer.status, answer.headers, answer.read()


def raw(server, sent):
    """All that comes back for these bytes, until the server ends the connection or says nothing for a moment."""
    answer = b""
    with socket.create_connection(("127.0.0.1", server.port), timeout=0.3) as connection, suppress(OSError):
        connection.sendall(sent)
        while part := connection.recv(65536):
            answer += part
    return answer


def test_answers_what_is_asked(server):
    status, headers, body = ask(server, "/a/b?c=d")
    assert (status, json.loads(body)) == (200, {"path": "/a/b?c=d"})
    assert headers["Content-Type"] == "application/json"


def test_head_is_get_without_the_body(server):
    status, headers, body = ask(server, "/a", "HEAD")
    assert (status, body) == (200, b"")
    assert int(headers["Content-Length"]) == len(json.dumps({"path": "/a"}))


@pytest.mark.parametrize("path", ["/", "/secret", "/broken"])
def test_no_answer_can_be_embedded_or_read_elsewhere(server, path):
    headers = ask(server, path)[1]
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert headers["Access-Control-Allow-Origin"] is None
    assert headers["Server"] == "Lippmann"


@pytest.mark.parametrize(
    ("path", "status", "line"),
    [
        ("/secret", 404, "there is nothing here"),
        ("/broken", 422, "a.png: is damaged; fetch it anew"),
        ("/huge", 507, "out of memory; close other programs"),
    ],
)
def test_errors_are_one_line(server, path, status, line):
    found, headers, body = ask(server, path)
    assert (found, json.loads(body)) == (status, {"error": line})
    assert headers["Content-Type"] == "application/json"


def test_a_fault_is_reported_and_the_server_goes_on(server, capfd):
    status, headers, body = ask(server, "/fault")
    assert (status, json.loads(body)) == (500, {"error": "internal error; the terminal says which"})
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert ask(server)[0] == 200
    assert "ZeroDivisionError: a fault" in capfd.readouterr().err


@pytest.mark.parametrize(
    "host", ["localhost", "localhost:9000", "127.0.0.1", "127.0.0.1:1", "[::1]:80", "LOCALHOST:80"]
)
def test_names_of_this_machine_are_served_through_any_port(server, host):
    assert ask(server, headers={"Host": host})[0] == 200


@pytest.mark.parametrize(
    "host",
    [
        "",
        "evil.example",
        "evil.example:80",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "evil.example@localhost.evil.example",
        "192.168.1.7",
        "0.0.0.0",
        "[::1",
        "[fe80::1]",
    ],
)
def test_foreign_names_are_refused(server, host):
    assert ask(server, headers={"Host": host})[0] == 403


@pytest.mark.parametrize("hosts", [b"", b"Host: localhost\r\nHost: evil.example\r\n"], ids=["none", "two"])
def test_one_host_must_be_named(server, hosts):
    assert raw(server, b"GET / HTTP/1.1\r\n" + hosts + b"\r\n").startswith(b"HTTP/1.1 400 ")
    assert raw(server, b"GET / HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 403 ")


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "PROPFIND", "get"])
def test_other_methods_are_refused(server, method):
    status, headers, _ = ask(server, method=method)
    assert status == 405
    assert "default-src 'none'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    "sent",
    [
        b"\r\n\r\n",
        b"GET\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET / HTTP/9.9\r\nHost: localhost\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: " + b"a" * 100_000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: a\r\n" * 1000 + b"\r\n",
        bytes(range(256)) * 10,
    ],
    ids=["empty", "short", "tls", "version", "path", "header", "headers", "noise"],
)
def test_what_is_no_request_is_refused_and_the_server_goes_on(server, sent):
    answer = raw(server, sent)
    assert b"200 OK" not in answer
    assert ask(server)[0] == 200


def test_the_body_of_a_get_is_not_the_next_request(server):
    inner = b"GET /inner HTTP/1.1\r\nHost: localhost\r\n\r\n"
    outer = b"GET /outer HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % len(inner)
    answer = raw(server, outer + inner)
    assert answer.count(b"HTTP/1.1 ") == 1
    assert b"inner" not in answer


def test_post_takes_json_of_its_own_pages(server):
    kind = {"Content-Type": "application/json"}
    own = {"Origin": f"http://127.0.0.1:{server.port}"}
    assert ask(server, method="POST", headers=kind | own, body=b"{}")[::2] == (200, b"{}")
    assert ask(server, method="POST", headers=kind, body=b"{}")[0] == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Content-Type": "application/json", "Origin": "http://evil.example"}, 403),
        ({"Content-Type": "application/json", "Origin": "null"}, 403),
        ({"Content-Type": "application/json", "Origin": "http://127.0.0.1:1"}, 403),
        ({"Content-Type": "text/plain"}, 415),
        ({"Content-Type": "application/x-www-form-urlencoded"}, 415),
        ({}, 415),
        ({"Content-Type": "application/json", "Content-Length": "-1"}, 400),
        ({"Content-Type": "application/json", "Content-Length": "1e3"}, 400),
        ({"Content-Type": "application/json", "Content-Length": None, "Transfer-Encoding": "chunked"}, 411),
        ({"Content-Type": "application/json", "Content-Length": "99999999999"}, 413),
    ],
)
def test_post_of_others_is_refused(server, headers, status):
    assert ask(server, method="POST", headers=headers, body=b"{}")[0] == status


def test_listens_on_this_machine_only(server):
    assert server.address == f"http://127.0.0.1:{server.port}/"
    assert is_loopback("127.0.0.1")
    assert is_loopback("::1")
    assert is_loopback("localhost")
    assert not is_loopback("0.0.0.0")
    assert not is_loopback("192.168.1.7")
    outside = outer_address()
    if outside is None:
        pytest.skip("this machine has no address but its own")
    with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
        socket.create_connection((outside, server.port), timeout=2)


def outer_address():
    """An address by which others reach this machine, or None."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent
        except OSError:
            return None
        address = probe.getsockname()[0]
    return None if is_loopback(address) or address == "0.0.0.0" else address


def test_listening_on_all_addresses_is_reached_by_number_and_own_name():
    with WebServer(Echo(), "0.0.0.0") as server:
        assert server.address == f"http://127.0.0.1:{server.port}/"
        assert ask(server, headers={"Host": "192.168.1.7:80"})[0] == 200
        assert ask(server, headers={"Host": socket.gethostname()})[0] == 200
        assert ask(server, headers={"Host": "evil.example"})[0] == 403


def test_a_port_in_use_is_said(server):
    with pytest.raises(UsageError, match=f"port: port {server.port} is in use") as caught:
        WebServer(Echo(), port=server.port)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("port", [-1, 65536])
def test_no_port(port):
    with pytest.raises(UsageError, match="is no port"):
        WebServer(Echo(), port=port)


@pytest.mark.parametrize("host", ["192.0.2.1", "no such name", "256.1.1.1", "", "a" * 300, "\u00fc" * 70])
def test_an_address_of_another_machine(host):
    with pytest.raises(UsageError, match="host"):
        WebServer(Echo(), host)


def test_the_port_is_free_once_the_server_is_closed():
    with WebServer(Echo()) as server:
        port = server.port
        assert ask(server)[0] == 200
    with WebServer(Echo(), port=port) as again:
        assert ask(again)[0] == 200


def test_a_closed_server_answers_nobody_who_is_still_connected():
    with WebServer(Echo()) as server:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
        connection.request("GET", "/")
        assert connection.getresponse().read()
        connection.auto_open = 0

        def ask_again():
            connection.request("GET", "/")
            return connection.getresponse()

    with closing(connection), pytest.raises((http.client.HTTPException, ConnectionError)):
        ask_again()
