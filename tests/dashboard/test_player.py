"""A recording in place of the bench: what it shows, and how it is steered."""

import numpy as np
import pytest
from tests.dashboard_bench import open_bench, until

from tubefoot.dashboard.feed import Cursor
from tubefoot.dashboard.helm import Helm
from tubefoot.dashboard.player import Player
from tubefoot.errors import ConfigError
from tubefoot.lab.recording import Recording
from tubefoot.vision.layout import reference_layout

TABLE = "time_s,direction,duty,duration_s\n0.1,1,0.6,0.4\n"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Two seconds with pictures, one pulse to the right in them."""
    with open_bench(tmp_path_factory.mktemp("recorded"), pixels=True, helm=Helm(1e9)) as bench:
        bench.desk.beat("me")
        bench.desk.do("me", {"do": "take"})
        bench.desk.do("me", {"do": "play", "table": TABLE})
        assert bench.ended() == "1 pulses done"
        return bench.session.log.directory / "bench.mcap"


@pytest.fixture
def player(recording):
    from tubefoot.config import load_settings
    from tubefoot.vision.layout import MarkerLayout

    layout = load_settings(recording.with_name("layout.toml"), MarkerLayout)
    made = Player(Recording(recording), recording.with_name("camera.toml"), layout)
    made.do("any", {"do": "pause"})
    made.start()
    yield made
    made.close()


def test_it_plays_to_its_end_at_the_speed_asked_for(player):
    cursor, samples, angles = Cursor(), [], []
    player.do("any", {"do": "speed", "factor": 20})
    player.do("any", {"do": "play"})
    until(lambda: player.feed.status["replay"]["at_s"] == player.feed.status["replay"]["length_s"])
    until(lambda: not player.feed.status["replay"]["playing"])
    news = player.feed.after(cursor)
    samples += news.samples
    angles += news.angles
    assert np.diff([row[0] for row in samples]).max() < 0.03
    assert max(row[1] for row in samples) > 3.0  # kPa in the right branch
    assert {row[4] for row in samples} == {0.0, 1.0}
    assert angles[-1][1] > 1.0  # deg
    player.do("any", {"do": "play"})  # begins anew
    until(lambda: player.feed.status["replay"]["at_s"] > 0)


def test_a_jump_shows_the_picture_of_that_time_measured_anew(player):
    length = player.feed.status["replay"]["length_s"]
    bends = []
    for place in (0.05, length):
        player.do("any", {"do": "seek", "time_s": place})
        wanted = player._begin + place
        sight = until(lambda wanted=wanted: _sight_near(player, wanted))
        assert len(sight.outlines) == 5
        bends.append(sight.shape[-1, 2])
    assert np.degrees(bends[1] - bends[0]) > 1.0


def _sight_near(player, time):
    sight = player.feed.after(Cursor()).sight
    return sight if sight is not None and 0 <= time - sight.time < 0.2 else None


def test_nothing_but_the_replay_can_be_steered(player):
    with pytest.raises(ConfigError, match="not for a replay"):
        player.do("any", {"do": "pulse", "direction": 1})
    with pytest.raises(ConfigError, match="factor"):
        player.do("any", {"do": "speed", "factor": 0})
    assert "no pump is connected" in player.trip("a test")


def test_without_a_camera_file_pictures_are_shown_as_they_are(recording):
    made = Player(Recording(recording), None, reference_layout())
    made.start()
    sight = until(lambda: made.feed.after(Cursor()).sight)
    assert sight.jpeg.startswith(b"\xff\xd8")
    assert len(sight.outlines) == 0
    made.close()
