"""What every camera must do, whatever stands behind it; the clock is moved by hand."""

import numpy as np
import pytest

from tubefoot.errors import LinkError
from tubefoot.vision.camera import EndOfFrames, StaleFrameError

SIZE = (64, 48)
FRAMES = 5
PERIOD = 0.1


def numbered_picture(number):
    """A picture whose grey level is ten times its number."""
    return np.full((SIZE[1], SIZE[0]), 10 * number, dtype=np.uint8)


class CameraContract:
    """Subclasses make `self.camera()`, paced ones `self.stall(...)`; five frames, 0.1 s apart."""

    def test_frames_come_once_and_in_order(self):
        with self.camera() as camera:
            frames = [self.next_frame(camera) for _ in range(FRAMES)]
        assert [frame.index for frame in frames] == list(range(FRAMES))
        levels = [frame.picture.mean() for frame in frames]
        np.testing.assert_allclose(levels, 10 * np.arange(FRAMES), atol=3)

    def test_capture_times_are_those_of_the_frames(self):
        with self.camera() as camera:
            times = [self.next_frame(camera).time_s for _ in range(FRAMES)]
        np.testing.assert_allclose(np.diff(times), PERIOD, atol=1e-6)

    def test_resolution_is_known_once_open(self):
        with self.camera() as camera:
            assert camera.resolution == SIZE
            assert self.next_frame(camera).picture.shape[:2] == SIZE[::-1]

    def test_end_is_told(self):
        with self.camera() as camera:
            for _ in range(FRAMES):
                self.next_frame(camera)
            with pytest.raises((EndOfFrames, LinkError)):
                self.next_frame(camera)

    def test_close_twice_and_open_again(self):
        camera = self.camera()
        camera.open()
        camera.close()
        camera.close()
        with camera:
            assert self.next_frame(camera).picture is not None

    def next_frame(self, camera):
        return camera.read()


class PacedContract(CameraContract):
    """Cameras that deliver in real time."""

    def test_age_is_time_since_capture(self):
        with self.camera() as camera:
            frame = self.next_frame(camera)
            assert frame.age(frame.time_s + 0.03) == pytest.approx(0.03)

    def test_stale_frame_is_an_error_that_says_how_old(self):
        with self.camera() as camera:
            self.next_frame(camera)
            self.stall(camera, 0.7)
            with pytest.raises(StaleFrameError, match=r"7\d\d ms old, the limit is 250 ms"):
                camera.read()
