"""`tubefoot calibrate-camera` and `tubefoot track` as a user runs them, on rehearsed pictures."""

import csv
import json
import urllib.request

import cv2
import numpy as np
import pytest

from tubefoot.cli.camera_calibration import calibrate, print_sheets, rehearse
from tubefoot.cli.track import track
from tubefoot.errors import ConfigError, LinkError
from tubefoot.vision.live import LiveView


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory):
    out = tmp_path_factory.mktemp("rehearsal")
    rehearse(out=out, views=10, frames=12, bend_deg=30.0)
    arguments = {"plane_view": str(out / "plane.png"), "neutral": str(out / "neutral"), "out": out / "camera"}
    calibrate(str(out / "views"), **arguments)
    return out


def test_calibration_leaves_its_verdict(rehearsed):
    summary = json.loads((rehearsed / "camera" / "summary.json").read_text())
    assert summary["good"]
    assert summary["views"] == 10
    assert summary["zeroed"]
    assert cv2.imread(str(rehearsed / "camera" / "calibration.png")) is not None
    assert (rehearsed / "camera" / "run.toml").exists()


def test_tracked_angles_agree_with_the_truth(rehearsed, tmp_path):
    track(str(rehearsed / "bending"), camera=rehearsed / "camera" / "camera.toml", out=tmp_path)
    angles, truth = rows_of(tmp_path / "angles.csv"), rows_of(rehearsed / "truth.csv")
    assert len(angles) == len(truth) == 12
    for name, limit in (("bend_deg", 0.15), ("theta1_deg", 0.1), ("theta2_deg", 0.5)):
        errors = [float(row[name]) - float(true[name]) for row, true in zip(angles, truth, strict=True)]
        assert np.max(np.abs(errors)) < limit, name
    assert {row["lost"] for row in angles} == {"false"}
    assert all(float(row["sigma_deg"]) < 0.1 for row in angles)
    film = cv2.VideoCapture(str(tmp_path / "annotated.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 12
    film.release()


def test_positive_is_towards_the_left(rehearsed):
    """The rehearsal's first quarter bends by a positive angle: the tip marker moves to smaller picture x."""
    tips = []
    for name in ("frame_0000.png", "frame_0003.png"):
        picture = cv2.imread(str(rehearsed / "bending" / name), cv2.IMREAD_GRAYSCALE)
        finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
        corners, ids, _ = finder.detectMarkers(picture)
        tips.append(corners[list(np.ravel(ids)).index(7)][0].mean(axis=0)[0])
    assert float(rows_of(rehearsed / "truth.csv")[3]["bend_deg"]) > 20
    assert tips[1] < tips[0] - 20


def test_lost_frames_have_no_angle(rehearsed, tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(3):
        picture = cv2.imread(str(rehearsed / "bending" / f"frame_{number:04d}.png"), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(folder / f"{number}.png"), picture if number != 1 else np.zeros_like(picture))
    track(str(folder), camera=rehearsed / "camera" / "camera.toml", out=tmp_path / "out", video=False)
    rows = rows_of(tmp_path / "out" / "angles.csv")
    assert [row["lost"] for row in rows] == ["false", "true", "false"]
    assert rows[1]["bend_deg"] == rows[1]["sigma_deg"] == rows[1]["theta1_deg"] == ""
    assert rows[1]["visible_markers"] == "0"
    assert rows[1]["fault"]
    assert not (tmp_path / "out" / "annotated.mp4").exists()


def test_damaged_picture_keeps_what_was_measured(rehearsed, tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    data = (rehearsed / "bending" / "frame_0000.png").read_bytes()
    (folder / "0.png").write_bytes(data)
    (folder / "1.png").write_bytes(data[:500])
    with pytest.raises(LinkError, match=r"1\.png: cannot be decoded"):
        track(str(folder), camera=rehearsed / "camera" / "camera.toml", out=tmp_path / "out", video=False)
    assert len(rows_of(tmp_path / "out" / "angles.csv")) == 1
    assert "cannot be decoded" in (tmp_path / "out" / "run.toml").read_text()


def test_recording_is_tracked(rehearsed, tmp_path):
    pytest.importorskip("mcap")
    from tubefoot.lab.recorder import Recorder
    from tubefoot.lab.settings import RigSettings

    path = tmp_path / "bench.mcap"
    recorder = Recorder(path, RigSettings(), 0.0)
    for number in range(4):
        data = (rehearsed / "bending" / f"frame_{number:04d}.png").read_bytes()
        recorder.frame(2.0 + number / 30, data, 640, 480)
    recorder.close()
    track(str(path), camera=rehearsed / "camera" / "camera.toml", out=tmp_path / "out", video=False)
    rows = rows_of(tmp_path / "out" / "angles.csv")
    assert [float(row["time_s"]) for row in rows] == pytest.approx([2 + number / 30 for number in range(4)])
    assert {row["lost"] for row in rows} == {"false"}


def test_virtual_source_needs_no_calibration(tmp_path):
    track("virtual", out=tmp_path, frames=4, video=False)
    rows = rows_of(tmp_path / "angles.csv")
    assert len(rows) == 4
    assert float(rows[3]["bend_deg"]) > float(rows[0]["bend_deg"]) + 3


def test_missing_calibration_says_what_to_do(rehearsed, tmp_path):
    with pytest.raises(ConfigError, match="--camera is missing"):
        track(str(rehearsed / "bending"), out=tmp_path)


def test_sheets_are_printed(tmp_path):
    print_sheets(out=tmp_path)
    assert {path.name for path in tmp_path.iterdir()} >= {
        "board.pdf",
        "board.svg",
        "markers.pdf",
        "markers.svg",
    }


def test_live_view_serves_the_newest_frame():
    view = LiveView(0)
    try:
        view.show(np.full((48, 64), 130, np.uint8))
        with urllib.request.urlopen(view.address, timeout=5) as stream:
            head = stream.readline() + stream.readline()
            length = int(stream.readline().split(b":")[1])
            stream.readline()
            picture = cv2.imdecode(np.frombuffer(stream.read(length), np.uint8), cv2.IMREAD_GRAYSCALE)
        assert b"image/jpeg" in head
        assert picture.shape == (48, 64)
        assert abs(float(picture.mean()) - 130) < 2
        with pytest.raises(ConfigError, match="port cannot be used"):
            LiveView(int(view.address.rsplit(":", 1)[1].strip("/")))
    finally:
        view.close()
