"""Calibration from rendered views against the lens and plane they were rendered with."""

import re
import subprocess

import cv2
import numpy as np
import pytest
from rod import grasps

from tubefoot.config import load_settings
from tubefoot.errors import ConfigError
from tubefoot.units import DEG
from tubefoot.vision.board import Board, BoardSettings
from tubefoot.vision.calibration import CameraCalibration, load_calibration
from tubefoot.vision.finger import FingerTracker
from tubefoot.vision.layout import MarkerLayout
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlanarPose, PlaneMap, PlanePose
from tubefoot.vision.rehearsal import Rehearsal, even_bend
from tubefoot.vision.tracker import MarkerTracker, averaged
from tubefoot.vision.views import BoardView, calibrate_lens, gather_views, plane_of_view


@pytest.fixture(scope="module")
def layout():
    return load_settings("examples/vision/finger-12-five.toml", MarkerLayout)


@pytest.fixture(scope="module")
def rehearsal(layout):
    return Rehearsal(layout, seed=2)


@pytest.fixture(scope="module")
def found(rehearsal):
    board = Board()
    pictures = [(f"view {number}", view) for number, view in enumerate(rehearsal.board_views(board, 14))]
    pictures.append(("empty", np.full((480, 640), 90, np.uint8)))
    views, dropped, size = gather_views(pictures, board)
    return calibrate_lens(views, board, size, dropped)


@pytest.fixture(scope="module")
def calibration(rehearsal, found, layout):
    board = Board()
    ids, pixels = board.find(rehearsal.plane_view(board))
    plane, sigma = plane_of_view(BoardView("plane", ids, pixels), board, found.lens)
    unzeroed = CameraCalibration.of(found.lens, plane, sigma, found.residual_px)
    tracker = MarkerTracker(PlaneMap(unzeroed.to_lens(), unzeroed.to_plane()), layout)
    frames = [tracker.measure(rehearsal.frame(even_bend(layout, 0.0)), i / 30) for i in range(5)]
    return unzeroed.zeroed_by(averaged(frames), layout)


def test_lens_is_found(found, rehearsal):
    """Where the found lens puts a point of the scene, against the true lens."""
    points = np.stack(np.meshgrid(np.linspace(-70, 70, 9), np.linspace(-50, 50, 7), [180, 230]), -1).reshape(
        -1, 3
    )
    shift = found.lens.project(points) - rehearsal.lens.project(points)
    # a change of focal length and of distance look alike: judge what is left without it
    centred = shift - shift.mean(axis=0)
    assert np.sqrt(np.mean(centred**2)) < 0.6
    assert found.lens.focal_x == pytest.approx(rehearsal.lens.focal_x, rel=5 * found.focal_sigma)
    assert found.residual_px < 0.1
    assert found.dropped == ["empty"]
    assert found.faults() == []


def test_plane_is_found_within_its_uncertainty(calibration, rehearsal):
    miss = np.arccos(min(calibration.to_plane().normal @ rehearsal.plane.normal, 1.0)) / DEG
    assert miss < 0.15
    assert 0.005 < calibration.plane.tilt_sigma_deg < 0.1


def test_zero_puts_the_frame_on_the_finger(calibration, rehearsal):
    base, up = calibration.to_plane().in_space([[0, 0], [0, 92]])
    true_base, true_up = rehearsal.plane.in_space([[0, 0], [0, 92]])
    direction = (up - base) / 92 - (true_up - true_base) / 92
    assert np.linalg.norm(direction) < 0.004
    assert np.linalg.norm((base - true_base)[:2]) < 0.5


def run_end_to_end(calibration, rehearsal, layout, count):
    """Errors of bend, theta1 and theta2 [deg] and reported uncertainty of the bend [deg]."""
    tracker = FingerTracker(calibration, layout)
    heights = np.array([0.0, layout.length_mm / 2, layout.length_mm, layout.markers[-1].z_mm])
    errors, sigmas = [], []
    for index in range(count):
        bend = 70 * DEG * np.sin(0.05 * index)
        shape = even_bend(layout, bend, bend / 2 + min(1, index / 20) * 15 * DEG * np.sin(0.031 * index))
        reading = tracker.measure(rehearsal.frame(shape), index / 30)
        base, middle, tip, marker = shape(heights)[1]
        true = np.array([marker, middle - base, tip - middle])
        errors.append((np.array([reading.bend, reading.theta1, reading.theta2]) - true) / DEG)
        sigmas.append(reading.sigma / DEG)
    return np.array(errors), np.array(sigmas)


def test_end_to_end_few_frames(calibration, rehearsal, layout):
    errors, _ = run_end_to_end(calibration, rehearsal, layout, 12)
    assert np.all(np.std(errors, axis=0) <= (0.03, 0.05, 0.05))
    assert np.max(np.abs(errors)) <= 0.1


@pytest.mark.slow
def test_end_to_end(calibration, rehearsal, layout):
    errors, sigmas = run_end_to_end(calibration, rehearsal, layout, 130)
    assert np.std(errors[:, 0]) <= 0.03
    assert np.max(np.abs(errors[:, 1:])) <= 0.1
    assert 0.85 <= np.mean(np.abs(errors[:, 0]) <= 2 * sigmas) <= 1.0


def rod_shape(rod):
    """A pressed rod as a shape that the rehearsal draws; straight beyond its ends."""
    at, places, angle = rod

    def shape(heights):
        direction = np.interp(heights, at, angle)
        beyond = np.asarray(heights) - np.clip(heights, 0, at[-1])
        inside = np.column_stack([np.interp(heights, at, axis) for axis in places.T])
        return inside + beyond[:, None] * np.column_stack([-np.sin(direction), np.cos(direction)]), direction

    return shape


@pytest.mark.slow
def test_thetas_of_rendered_grasps(calibration, rehearsal, layout):
    """Frames of fingers pressed by a contact, through the whole calibrated chain."""
    errors = []
    for rod, _ in grasps(40):
        if abs(rod[2][-1]) > 75 * DEG:
            continue
        reading = FingerTracker(calibration, layout).measure(rehearsal.frame(rod_shape(rod)), 0.0)
        middle, tip = np.interp(46, rod[0], rod[2]), rod[2][-1]
        errors.append(np.array([reading.theta1 - middle, reading.theta2 - (tip - middle)]) / DEG)
    assert len(errors) >= 30
    assert np.max(np.abs(errors)) <= 0.1


def test_calibration_survives_its_file(calibration, tmp_path):
    path = calibration.save(tmp_path / "camera.toml")
    again = load_calibration(path)
    assert again == calibration
    np.testing.assert_allclose(again.to_plane().rotation, calibration.to_plane().rotation, atol=1e-12)


def test_typo_in_the_file_names_the_key(calibration, tmp_path):
    path = calibration.save(tmp_path / "camera.toml")
    path.write_text(path.read_text().replace("focal_x_px", "focal_px"))
    with pytest.raises(ConfigError, match=r"did you mean `focal_[xy]_px`"):
        load_calibration(path)


def test_crooked_axes_are_refused(calibration):
    bent = calibration.plane.model_copy(update={"axis_z": (0.0, -0.8, 0.6)})
    with pytest.raises(ConfigError, match="right angle"):
        calibration.model_copy(update={"plane": bent}).to_plane()


def test_too_few_views(rehearsal):
    board = Board()
    views, dropped, size = gather_views([("a", rehearsal.plane_view(board))], board)
    with pytest.raises(ConfigError, match=r"only 1 of 1 pictures .* 6 are needed"):
        calibrate_lens(views, board, size, dropped)


def test_poor_views_are_called_poor(rehearsal):
    """All views face the camera from the same place."""
    board = Board()
    views = []
    for index in range(7):
        plane = PlanePose.facing(420 + 2 * index, 0.01 * index, 0.0, (0.5 * index, 0.0))
        ids = np.arange(len(board.corners))
        noise = np.random.default_rng(index).normal(0, 0.05, (len(ids), 2))
        views.append(BoardView(str(index), ids, plane.to_pixels(board.corners, rehearsal.lens) + noise))
    faults = " ".join(calibrate_lens(views, board, (640, 480), []).faults())
    assert "tilted by" in faults
    assert "cover" in faults


def test_frame_of_another_size(calibration, layout):
    with pytest.raises(ConfigError, match="320 x 240 px but the calibration holds for 640 x 480 px"):
        FingerTracker(calibration, layout).measure(np.zeros((240, 320), np.uint8), 0.0)


def test_neutral_view_without_a_marker(calibration, rehearsal, layout):
    tracker = MarkerTracker(PlaneMap(calibration.to_lens(), calibration.to_plane()), layout)
    with pytest.raises(ConfigError, match="does not show marker 1, 2, 4, 7, 11"):
        calibration.zeroed_by(tracker.measure(np.zeros((480, 640), np.uint8), 0.0), layout)


def test_plane_seen_edge_on_is_refused():
    with pytest.raises(ConfigError, match="edge-on"):
        PlaneMap(Lens.centred(640, 480, 500), PlanePose.facing(200, 80 * DEG))


def test_plane_map_agrees_with_exact_rays(rehearsal):
    plane_map = PlaneMap(rehearsal.lens, rehearsal.plane)
    rng = np.random.default_rng(0)
    columns, rows = rng.integers(0, 640, 200), rng.integers(0, 480, 200)
    exact = rehearsal.plane.from_pixels(np.column_stack([columns, rows]), rehearsal.lens)
    np.testing.assert_allclose(plane_map.points[rows, columns], exact, atol=2e-5)
    back = plane_map.to_pixels(exact)
    np.testing.assert_allclose(back, np.column_stack([columns, rows]), atol=1e-6)


def test_moved_plane_and_poses_agree():
    plane, pose = PlanePose.facing(200, 0.2, -0.1, (3, 4)), PlanarPose(5.0, -7.0, 0.4)
    points = np.array([[1.0, 2.0], [-3.0, 0.5]])
    np.testing.assert_allclose(plane.moved(pose).in_space(points), plane.in_space(pose.to_outer(points)))
    np.testing.assert_allclose(pose.to_inner(pose.to_outer(points)), points)
    other = PlanarPose(1.0, 2.0, 3.0)
    back = pose.then(other).seen_from(pose)
    np.testing.assert_allclose([back.x, back.z, back.angle], [1.0, 2.0, 3.0])


def test_board_is_found_where_it_was_drawn(rehearsal):
    """Corners against the projection of their printed places: the compositor against OpenCV's board."""
    board = Board(BoardSettings(squares_x=6, squares_y=5, square_mm=14))
    ids, pixels = board.find(rehearsal.plane_view(board))
    assert len(ids) == 20
    pose = PlanarPose(-2.0, rehearsal.layout.length_mm / 2 + 3.0, 0.03)
    true = rehearsal.plane.to_pixels(pose.to_outer(board.corners[ids]), rehearsal.lens)
    assert np.sqrt(np.mean((pixels - true) ** 2)) < 0.06


def test_sheets_are_to_scale(tmp_path, layout):
    """The PDF, rasterised by poppler where it is installed and read by OpenCV; the SVG by its numbers."""
    from tubefoot.vision.sheets import board_sheet, marker_sheet

    sheet = marker_sheet(layout)
    svg = sheet.svg()
    assert 'width="210mm"' in svg
    assert 'viewBox="0 0 210 297"' in svg
    assert re.search(r'width="100\.0000" height="0\.6000"', svg)
    dots_a_mm = 300 / 25.4
    pages = {"markers": sheet, "board": board_sheet(Board())}
    for name, page in pages.items():
        _, pdf = page.save(tmp_path / name)
        picture = rasterised(pdf, tmp_path / name)
        assert picture.shape[1] / dots_a_mm == pytest.approx(210, abs=0.1)
        if name == "board":
            ids, pixels = Board().find(picture)
            assert len(ids) == 48
            steps = np.linalg.norm(np.diff(pixels[np.argsort(ids)].reshape(8, 6, 2), axis=1), axis=2)
            np.testing.assert_allclose(steps / dots_a_mm, 20.0, atol=0.09)  # a dot is 0.085 mm
            assert np.mean(steps) / dots_a_mm == pytest.approx(20.0, abs=0.01)
        else:
            finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
            corners, ids, _ = finder.detectMarkers(picture)
            assert sorted(np.ravel(ids)) == [1, 2, 4, 7, 11]
            for quad in corners:
                sides = np.linalg.norm(quad[0] - np.roll(quad[0], 1, axis=0), axis=1)
                np.testing.assert_allclose((sides + 1) / dots_a_mm, 10.0, atol=0.12)
                # upright on the sheet: the first corner is the upper left one
                assert np.argmin(quad[0].sum(axis=1)) == 0


def rasterised(pdf, stem):
    subprocess.run(["pdftoppm", "-r", "300", "-gray", "-png", "-singlefile", pdf, stem], check=True)
    return cv2.imread(str(stem) + ".png", cv2.IMREAD_GRAYSCALE)


def test_board_too_large_for_its_paper():
    from tubefoot.vision.sheets import board_sheet

    with pytest.raises(ConfigError, match="does not fit on a4"):
        board_sheet(Board(BoardSettings(square_mm=40)))
