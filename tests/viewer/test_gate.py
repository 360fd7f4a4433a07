"""Nobody drives the viewer but whoever has its address."""

import http.client
import re
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.library import Library
from mocapdb.viewer.gate import Gate
from mocapdb.viewer.pictures import picture_html

GATE = Gate("127.0.0.1", 8080, token="secret")
OPEN = Gate("0.0.0.0", 8080, token="secret")
HOST = {"Host": "127.0.0.1:8080"}


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:8080", "[::1]:8080"])
def test_the_address_that_was_printed_opens(host):
    assert GATE.refusal("/?token=secret", {"Host": host}) is None
    own = {"Host": host, "Origin": f"http://{host}", "Cookie": "a=b; mocapdb-8080=secret"}
    assert GATE.refusal("/assets/index.js", own) is None


@pytest.mark.parametrize(
    "host", ["", "127.0.0.1", "127.0.0.1:80", "evil.example:8080", "127.0.0.1.evil.example:8080",
             "x@127.0.0.1:8081", "127.0.0.1:nonsense", "[::1:8080"],
)  # fmt: skip
def test_another_name_that_leads_here_does_not(host):
    assert "not the address" in GATE.refusal("/?token=secret", {"Host": host})


@pytest.mark.parametrize(
    "origin", ["null", "", "http://evil.example", "http://127.0.0.1:9999", "https://127.0.0.1:8080",
               "http://evil.example:8080"],
)  # fmt: skip
def test_pages_of_other_sites_do_not(origin):
    cookie = {"Cookie": "mocapdb-8080=secret"}
    assert "other sites" in GATE.refusal("/", HOST | cookie | {"Origin": origin})


@pytest.mark.parametrize("cookie", ["", "mocapdb-8080=wrong", "mocapdb-8081=secret", ";=;", "\0"])
@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=wrong", "/?tokens=secret"])
def test_without_the_token_nobody_does(path, cookie):
    assert "token" in GATE.refusal(path, HOST | {"Cookie": cookie})


@given(path=st.text(), cookie=st.text(), host=st.text(), origin=st.none() | st.text())
def test_whatever_is_sent_is_answered(path, cookie, host, origin):
    headers = {"Host": host, "Cookie": cookie} | ({} if origin is None else {"Origin": origin})
    assert GATE.refusal(path, headers) is not None


def test_a_server_for_all_takes_addresses_but_no_foreign_names():
    for host in ("192.168.0.7:8080", "[fe80::1]:8080", "localhost:8080"):
        assert OPEN.refusal("/?token=secret", {"Host": host}) is None
    assert OPEN.refusal("/?token=secret", {"Host": "evil.example:8080"}) is not None


def test_tokens_are_never_the_same():
    assert Gate("127.0.0.1", 1).token != Gate("127.0.0.1", 1).token


def test_the_server_asks_the_gate(seen_library, tmp_path, monkeypatch):
    pytest.importorskip("viser")
    monkeypatch.setenv("MOCAPDB_CACHE", str(tmp_path))
    from mocapdb.viewer import Viewer

    with Viewer(seen_library, port=0) as viewer:
        address = urlsplit(viewer.url)

        def asked(path, **headers):
            connection = http.client.HTTPConnection(address.hostname, address.port, timeout=120)
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            answer.read()
            connection.close()
            return answer

        whole = f"/?{address.query}"
        assert asked("/").status == 403
        assert asked(whole, Host="evil.example").status == 403
        assert asked(whole, Origin="http://evil.example").status == 403
        welcome = asked(whole)
        assert welcome.status == 200
        kept = welcome.getheader("Set-Cookie")
        assert re.search("HttpOnly; SameSite=Strict$", kept)
        cookie = kept.partition(";")[0]
        assert asked("/", Cookie=cookie).status == 200
        with Library(seen_library) as library:
            image = picture_html(library, library.record("01_01"))
        picture = "/" + re.search('src="([^"]+)"', image)[1]
        assert asked(picture).status == 403
        assert asked(picture, Cookie=cookie, Origin="http://evil.example").status == 403
        answer = asked(picture, Cookie=cookie)
        assert (answer.status, answer.getheader("Content-Type")) == (
            200, "image/svg+xml; charset=utf-8",
        )  # fmt: skip
        assert {each.getheader("Connection") for each in (answer, welcome)} == {"close"}
        assert "default-src 'none'" in answer.getheader("Content-Security-Policy")
        assert asked(re.sub("-[0-9a-f]{16}", "-" + 16 * "0", picture), Cookie=cookie).status == 404
        upgrade = {
            "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        }  # fmt: skip
        assert asked("/", Origin="http://evil.example", **upgrade).status == 403
        assert asked("/", **upgrade).status == 403
