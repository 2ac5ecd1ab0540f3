"""One camera for two readers: each gets every frame once, as if it had the camera to itself."""

from __future__ import annotations

from collections import deque

from tubefoot.vision.camera import Camera, CameraBase, Frame

KEPT = 2
"""Frames that wait for the slower reader; older ones are dropped."""


class SharedCamera(CameraBase):
    """One of two readers of a camera."""

    def __init__(self, camera: Camera, waiting: deque[Frame], other: deque[Frame], readers: set[int]):
        """Take a place.

        camera : that both read; waiting : frames that the other one has read already
        other : where the other reader finds frames; readers : those who have the camera open
        """
        self._camera = camera
        self._waiting, self._other = waiting, other
        self._readers = readers
        self.paced = camera.paced

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height of its frames [px]."""
        return self._camera.resolution

    def open(self) -> None:
        """Open the camera, unless the other reader has."""
        if not self._readers:
            self._camera.open()
        self._readers.add(id(self))

    def read(self) -> Frame:
        """The next frame; that of the other reader where it was there first."""
        if self._waiting:
            return self._waiting.popleft()
        frame = self._camera.read()
        self._other.append(frame)
        return frame

    def close(self) -> None:
        """Close the camera when the other reader has closed it too."""
        if id(self) in self._readers:
            self._readers.discard(id(self))
            if not self._readers:
                self._camera.close()


def shared_camera(camera: Camera) -> tuple[SharedCamera, SharedCamera]:
    """Two readers of one camera.

    camera : closed yet
    """
    mine: deque[Frame] = deque(maxlen=KEPT)
    yours: deque[Frame] = deque(maxlen=KEPT)
    readers: set[int] = set()
    return SharedCamera(camera, mine, yours, readers), SharedCamera(camera, yours, mine, readers)
