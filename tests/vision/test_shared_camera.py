"""One camera for two readers."""

import numpy as np

from tubefoot.vision.camera import CameraBase, Frame
from tubefoot.vision.shared import shared_camera


class Counting(CameraBase):
    """A camera that numbers its frames and its openings."""

    resolution = (4, 3)

    def __init__(self) -> None:
        self.opened = self.closed = self.frames = 0

    def open(self) -> None:
        self.opened += 1

    def read(self) -> Frame:
        self.frames += 1
        return Frame(np.zeros((3, 4), dtype=np.uint8), self.frames, float(self.frames))

    def close(self) -> None:
        self.closed += 1


def test_both_get_every_frame_once() -> None:
    one, other = shared_camera(Counting())
    seen = [(one.read().index, other.read().index) for _ in range(5)]
    assert seen == [(n, n) for n in range(1, 6)]


def test_a_slow_reader_gets_the_newest() -> None:
    one, other = shared_camera(Counting())
    for _ in range(9):
        one.read()
    assert other.read().index == 8


def test_it_is_opened_once_and_closed_by_the_last() -> None:
    camera = Counting()
    one, other = shared_camera(camera)
    one.open()
    other.open()
    one.close()
    one.close()
    assert (camera.opened, camera.closed) == (1, 0)
    other.close()
    assert camera.closed == 1
