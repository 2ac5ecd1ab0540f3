"""`tubefoot dashboard` as typed: bad input, the address it prints, Ctrl-C, the same page after a restart."""

import os
import signal
import socket
import subprocess
import sys
from urllib.request import urlopen

import pytest
from tests.dashboard_bench import free_port

from tubefoot.cli.main import app
from tubefoot.errors import ConfigError, LinkError


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["--sim", "--replay", "x.mcap"], "one of --sim, --port and --replay"),
        (["--sim", "--host", "0.0.0.0"], "SSH tunnel"),
        (["--sim", "--http-port", "70000"], "1 to 65534"),
        (["--sim", "--heartbeat-s", "0.1"], "0.5 to 60 s"),
        (["--replay", "none.mcap"], "cannot be read"),
        (["--sim", "--rig", "none.toml"], "no such file"),
    ],
)
def test_bad_input_is_told(tmp_path, words, fault):
    with pytest.raises(ConfigError, match=fault):
        app(["dashboard", *words, "--out", str(tmp_path)])


def test_a_bench_that_is_not_there_is_told_and_the_ports_are_free_again(tmp_path):
    port = str(free_port())
    for _ in range(2):
        with pytest.raises(LinkError, match="cannot be opened"):
            app(["dashboard", "--port", "/dev/none", "--http-port", port, "--out", str(tmp_path)])


def test_a_port_in_use_is_told(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match="choose another"):
            app(["dashboard", "--port", "/dev/none", "--http-port", str(port), "--out", str(tmp_path)])


def test_it_serves_until_ctrl_c_with_the_token_that_it_keeps(tmp_path):
    address = served_once(tmp_path, free_port())
    assert address.endswith(f"?token={(tmp_path / 'token').read_text()}")
    assert (tmp_path / "run.toml").exists()


def served_once(out, port):
    program = "from tubefoot.cli.main import main; main()"
    command = [sys.executable, "-c", program, "dashboard", "--sim", "--quick"]
    process = subprocess.Popen(
        [*command, "--http-port", str(port), "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONWARNINGS": "error"},
    )
    try:
        address = process.stdout.readline().removeprefix("dashboard: ").strip()
        with urlopen(address, timeout=60) as answer:
            assert "Emergency stop" in answer.read().decode()
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=60)
        assert "results:" in rest
        assert "Traceback" not in rest
        assert process.returncode in (0, 130)
        return address
    finally:
        process.kill()
