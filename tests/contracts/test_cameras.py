"""The camera contract, kept by every source; and what each one says when it cannot deliver."""

import cv2
import numpy as np
import pytest
from camera_contract import FRAMES, PERIOD, SIZE, CameraContract, PacedContract, numbered_picture

from tubefoot.errors import ConfigError, LinkError
from tubefoot.vision.picture_files import ImageFolder, VideoFile
from tubefoot.vision.sources import EncodedFrames, VirtualCamera, open_source
from tubefoot.vision.webcam import Webcam


class HandClock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class FakeCapture:
    """A V4L2 device as OpenCV shows it: properties, then frames with time stamps."""

    def __init__(self, clock, size=SIZE, opened=True):
        self.clock, self.size, self.opened = clock, size, opened
        self.number, self.delay = 0, 0.0
        self.stamp = 0.0

    def isOpened(self):
        return self.opened

    def set(self, key, value):
        return True

    def get(self, key):
        if key == cv2.CAP_PROP_POS_MSEC:
            return self.stamp * 1e3
        return {cv2.CAP_PROP_FRAME_WIDTH: self.size[0], cv2.CAP_PROP_FRAME_HEIGHT: self.size[1]}.get(key, 0.0)

    def read(self):
        if self.number >= FRAMES:
            return False, None
        self.clock.now += PERIOD
        self.stamp = self.clock.now - self.delay
        self.number += 1
        return True, numbered_picture(self.number - 1)

    def release(self):
        self.number = 0


class TestWebcam(PacedContract):
    def camera(self, **device):
        self.clock = HandClock()
        self.device = FakeCapture(self.clock, **device)
        return Webcam(0, SIZE, clock=self.clock, connect=lambda number: self.device)

    def stall(self, camera, seconds):
        self.device.delay = seconds

    def test_missing_camera_names_what_to_check(self):
        with pytest.raises(LinkError, match=r"camera 0 cannot be opened; devices here: .*cable"):
            self.camera(opened=False).open()

    def test_wrong_resolution_names_both(self):
        with pytest.raises(LinkError, match="delivers 640 x 360 px instead of 64 x 48 px"):
            self.camera(size=(640, 360)).open()

    def test_real_device_that_is_not_there(self):
        with pytest.raises(LinkError, match="cannot be opened"):
            Webcam("/dev/video97").open()


class TestVirtualCamera(PacedContract):
    def camera(self):
        self.clock = HandClock()
        self.clock.now = 0.05
        return VirtualCamera(
            lambda time_s: numbered_picture(round(time_s / PERIOD)),
            SIZE,
            self.clock,
            latency_s=0.05,
            last_s=(FRAMES - 0.5) * PERIOD,
        )

    def next_frame(self, camera):
        frame = camera.read()
        self.clock.now += PERIOD
        return frame

    def stall(self, camera, seconds):
        camera._latency = seconds
        self.clock.now = seconds + 0.1

    def test_latency_is_the_age_of_a_frame(self):
        with self.camera() as camera:
            assert camera.read().age(self.clock()) == pytest.approx(0.05)

    def test_drawing_of_another_size_is_refused(self):
        camera = VirtualCamera(lambda time_s: np.zeros((10, 10), np.uint8), SIZE, HandClock())
        with camera, pytest.raises(LinkError, match="drew 10 x 10 px instead of 64 x 48 px"):
            camera.read()


class TestImageFolder(CameraContract):
    @pytest.fixture(autouse=True)
    def _folder(self, tmp_path):
        self.folder = tmp_path / "pictures"
        self.folder.mkdir()
        for number in range(FRAMES):
            cv2.imwrite(str(self.folder / f"frame_{number:03d}.png"), numbered_picture(number))

    def camera(self):
        return ImageFolder(self.folder, 1 / PERIOD)

    def test_truncated_picture(self):
        path = self.folder / "frame_002.png"
        path.write_bytes(path.read_bytes()[:40])
        with self.camera() as camera:
            camera.read(), camera.read()
            with pytest.raises(LinkError, match=r"frame_002\.png: cannot be decoded"):
                camera.read()

    def test_another_size_within_the_folder(self):
        cv2.imwrite(str(self.folder / "frame_001.png"), np.zeros((20, 30), np.uint8))
        with self.camera() as camera:
            camera.read()
            with pytest.raises(LinkError, match="30 x 20 px, the first picture 64 x 48 px"):
                camera.read()

    def test_empty_folder(self, tmp_path):
        with pytest.raises(ConfigError, match="holds no pictures"):
            ImageFolder(tmp_path).open()


def read_all(camera):
    while True:
        camera.read()


class TestVideoFile(CameraContract):
    @pytest.fixture(autouse=True)
    def _video(self, tmp_path):
        self.path = tmp_path / "film.avi"
        self.write(FRAMES)

    def write(self, count):
        writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter.fourcc(*"MJPG"), 1 / PERIOD, SIZE)
        for number in range(count):
            writer.write(cv2.cvtColor(numbered_picture(number), cv2.COLOR_GRAY2BGR))
        writer.release()

    def camera(self):
        return VideoFile(self.path)

    def test_truncated_video_says_where(self):
        self.write(25)
        data = self.path.read_bytes()
        self.path.write_bytes(data[: len(data) * 2 // 3])
        with self.camera() as camera, pytest.raises(LinkError, match=r"breaks off after \d+ of 25 frames"):
            read_all(camera)

    def test_text_is_no_video(self, tmp_path):
        path = tmp_path / "notes.mp4"
        path.write_text("no film")
        with pytest.raises(ConfigError, match="cannot be read as a video"):
            VideoFile(path).open()

    def test_missing_file(self, tmp_path):
        with pytest.raises(ConfigError, match="no such video file"):
            VideoFile(tmp_path / "none.mp4").open()


class TestEncodedFrames(CameraContract):
    def camera(self):
        def source():
            for number in range(FRAMES):
                yield 7 + number * PERIOD, cv2.imencode(".png", numbered_picture(number))[1].tobytes()

        return EncodedFrames(source, "grasp.mcap")

    def test_damaged_frame(self):
        good = cv2.imencode(".png", numbered_picture(0))[1].tobytes()
        camera = EncodedFrames(lambda: [(0.0, good), (0.1, b"broken")], "grasp.mcap")
        camera.open()
        with pytest.raises(LinkError, match=r"frame 1 of grasp.mcap, at 0.100 s, cannot be decoded"):
            camera.read()

    def test_recording_without_frames(self):
        with pytest.raises(ConfigError, match="holds no camera frames"):
            EncodedFrames(lambda: [], "grasp.mcap").open()


def test_a_users_word_becomes_a_source(tmp_path):
    assert isinstance(open_source("0", SIZE), Webcam)
    assert isinstance(open_source("/dev/video3", SIZE), Webcam)
    assert isinstance(open_source(str(tmp_path), SIZE), ImageFolder)
    film = tmp_path / "film.mp4"
    film.touch()
    assert isinstance(open_source(str(film), SIZE), VideoFile)
    with pytest.raises(ConfigError, match="no such source; give a camera number"):
        open_source("fillm.mp4", SIZE)


@pytest.mark.parametrize("make", [lambda: Webcam(0), lambda: VideoFile("x.mp4")])
def test_reading_a_closed_source_is_an_error(make):
    with pytest.raises(LinkError, match="is not open"):
        make().read()
