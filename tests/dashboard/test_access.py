"""Who is let in: tokens, hosts and origins, by HTTP and websocket, at both servers."""

import json
import stat
from urllib.parse import urlencode

import pytest
from tests.dashboard_bench import TOKEN, post, served
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tubefoot.dashboard.access import Access, kept_token, loopback
from tubefoot.dashboard.wire import STATE, unpacked
from tubefoot.errors import ConfigError


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    with served(tmp_path_factory.mktemp("served"), pixels=False, live=False) as (bench, dashboard):
        yield bench, dashboard


def stop(dashboard, token=TOKEN, **headers):
    form = urlencode({"token": token} if token is not None else {})
    sent = {"Content_Type": "application/x-www-form-urlencoded", "Accept": "application/json"} | headers
    return post(dashboard, "/stop", form, dashboard.stop_server.port, X_Tubefoot_Token=None, **sent)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"X_Tubefoot_Token": None}, 401),
        ({"X_Tubefoot_Token": "wrong"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Host": "127.0.0.1.evil.example:80"}, 403),
    ],
)
def test_orders_need_token_host_and_origin(shown, headers, status):
    bench, dashboard = shown
    assert post(dashboard, "/api/do", {"do": "take"}, **headers)[0] == status
    if status != 200:
        assert bench.helm.holder in ("", "test")
    assert post(dashboard, "/api/beat", "", **headers)[0] == status
    assert post(dashboard, "/stop", "", **headers)[0] == status
    if bench.session.bench.line.tripped:
        assert status == 200
        bench.session.release()


@pytest.mark.parametrize(
    ("headers", "token", "status"),
    [
        ({}, TOKEN, 200),
        ({}, None, 401),
        ({}, "wrong", 403),
        ({"Origin": "http://evil.example"}, TOKEN, 403),
        ({"Host": "evil.example"}, TOKEN, 403),
    ],
)
def test_the_emergency_stops_own_server_keeps_the_same_rules(shown, headers, token, status):
    bench, dashboard = shown
    assert stop(dashboard, token, **headers)[0] == status
    assert bench.session.bench.line.tripped == (status == 200)
    bench.session.release()


def test_the_page_is_of_the_own_origin_for_both(shown):
    _, dashboard = shown
    assert post(dashboard, "/api/do", {"do": "take"}, Origin=dashboard.origin)[0] == 200
    assert stop(dashboard, Origin=dashboard.origin)[0] == 200
    shown[0].session.release()


def live(dashboard, token=TOKEN, **more):
    return connect(f"{dashboard.origin.replace('http', 'ws')}/live?token={token}&page=test", **more)


def test_the_websocket_needs_them_too(shown):
    _, dashboard = shown
    with live(dashboard, origin=dashboard.origin) as socket:
        first = unpacked(socket.recv(timeout=60))
        assert json.loads(first[STATE][1])["bench"]["virtual"]
    for token, more in ((TOKEN, {"origin": "http://evil.example"}), ("wrong", {}), ("", {})):
        with pytest.raises(InvalidStatus) as refused, live(dashboard, token, **more):
            pass
        assert refused.value.response.status_code == 403


def test_the_page_is_given_out_with_its_token_only_and_never_into_frames(shown):
    _, dashboard = shown
    from urllib.error import HTTPError
    from urllib.request import urlopen

    with urlopen(dashboard.address, timeout=60) as answer:
        assert TOKEN in answer.read().decode()
        assert "frame-ancestors 'none'" in answer.headers["Content-Security-Policy"]
        assert "Set-Cookie" not in answer.headers
    for tail, status in (("/", 401), ("/?token=wrong", 403), ("/api/finger", 401), ("/docs", 401)):
        with pytest.raises(HTTPError) as refused:
            urlopen(dashboard.origin + tail, timeout=60)
        assert refused.value.code == status
        assert TOKEN not in refused.value.read().decode()
        refused.value.close()


def test_a_token_is_kept_for_its_owner_and_made_anew_when_it_is_damaged(tmp_path):
    token = kept_token(tmp_path)
    assert kept_token(tmp_path) == token
    assert stat.S_IMODE((tmp_path / "token").stat().st_mode) == 0o600
    (tmp_path / "token").write_text("")
    assert len(kept_token(tmp_path)) >= 24
    assert kept_token(tmp_path) != token


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.0.7", "lab.example"])
def test_only_the_loopback_is_listened_on(host):
    with pytest.raises(ConfigError, match="SSH tunnel"):
        loopback(host)
    assert [loopback(good) for good in ("127.0.0.1", "localhost", "::1", "127.0.0.5")]


def test_tokens_beyond_ascii_are_refused_and_not_an_error():
    assert not Access(TOKEN).knows("türe")
    assert not Access(TOKEN).knows(None)
