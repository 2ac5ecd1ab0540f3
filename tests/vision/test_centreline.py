"""Centreline against arcs in closed form and rods pressed by a contact that the fit does not know."""

import numpy as np
import pytest
from rod import grasps, pressed_rod

from tubefoot.units import DEG
from tubefoot.vision.centreline import MarkedPoint, chord_angles, find_inflexions, fit_centreline

FOUR = (14.5, 35.5, 56.5, 77.5)
FIVE = (2.0, 25.0, 46.0, 67.0, 90.0)
NOISE_MM, NOISE_DEG = 0.004, 0.015


def marked(heights, rod, rng=None):
    at, places, angle = rod
    points = []
    for height in heights:
        x, z = (np.interp(height, at, axis) for axis in places.T)
        noise = rng.normal(0, (NOISE_MM, NOISE_MM, NOISE_DEG * DEG)) if rng else np.zeros(3)
        direction = np.interp(height, at, angle) + noise[2]
        points.append(MarkedPoint(height, x + noise[0], z + noise[1], direction, NOISE_MM, NOISE_DEG * DEG))
    return points


def test_arc_is_found_exactly():
    """Even curvature between rigid ends: turns of both halves and the tip are known."""
    curvature = 50 * DEG / 84
    line = fit_centreline(marked(FIVE, pressed_rod(curvature)), 92, 4, 4)
    np.testing.assert_allclose(np.array(line.thetas) / DEG, [25, 25], atol=0.01)
    radius, turn = 1 / curvature, 50 * DEG
    tip_x = -radius * (1 - np.cos(turn)) - 4 * np.sin(turn)
    tip_z = 4 + radius * np.sin(turn) + 4 * np.cos(turn)
    np.testing.assert_allclose(line.points[-1], [tip_x, tip_z], atol=0.01)
    np.testing.assert_allclose(line.curvature[1:-1], curvature, rtol=0.01)
    assert line.inflexions == ()


def theta_errors(heights, count):
    errors, sigmas = [], []
    for rod, rng in grasps(count):
        line = fit_centreline(marked(heights, rod, rng), 92, 4, 4)
        middle, tip = np.interp(46, rod[0], rod[2]), rod[2][-1]
        errors.append((np.array(line.thetas) - (middle, tip - middle)) / DEG)
        sigmas.append(np.array(line.theta_sigma) / DEG)
    return np.array(errors), np.array(sigmas)


def test_thetas_of_grasps_from_cap_to_cap():
    errors, _ = theta_errors(FIVE, 40)
    assert np.max(np.abs(errors)) <= 0.1


def test_thetas_of_grasps_from_unit_2_to_11():
    """theta2 reaches beyond the last marker: the fit says how far it guesses, and is right about it."""
    errors, sigmas = theta_errors(FOUR, 40)
    assert np.max(np.abs(errors[:, 0])) <= 0.1
    assert np.mean(np.abs(errors[:, 1]) <= 2 * sigmas[:, 1]) >= 0.9
    assert np.max(np.abs(errors[:, 1])) <= 0.8
    assert np.median(sigmas[:, 1]) <= 0.3  # the free tip's even curvature holds the guess together


def test_inflexion_of_a_pressed_finger():
    """A force strong enough turns the lower part the other way; the sign change of the rod is found."""
    rod = pressed_rod(0.012, 4e-4, 75)
    curvature = np.gradient(rod[2], rod[0])[60:860]
    crossing = rod[0][60:860][np.flatnonzero(np.diff(np.sign(curvature)) != 0)]
    assert len(crossing) == 1
    line = fit_centreline(marked(FIVE, rod), 92, 4, 4)
    assert len(line.inflexions) == 1
    assert line.inflexions[0] == pytest.approx(crossing[0], abs=4)
    assert line.thetas[0] * line.thetas[1] < 0


def test_wiggle_below_a_degree_is_no_inflexion():
    height = np.linspace(0, 90, 91)
    assert find_inflexions(height, np.where(height < 5, -1e-4, 1e-3)) == ()
    assert find_inflexions(height, np.where(height < 45, -1e-3, 1e-3)) == (pytest.approx(45, abs=1),)


def test_mirrored_finger_gives_mirrored_angles():
    rod = pressed_rod(0.01, 2e-4, 60)
    mirrored = (rod[0], rod[1] * (-1, 1), -rod[2])
    one = fit_centreline(marked(FOUR, rod), 92, 4, 4)
    two = fit_centreline(marked(FOUR, mirrored), 92, 4, 4)
    np.testing.assert_allclose(one.thetas, -np.array(two.thetas), atol=1e-9)


def test_few_markers_give_no_angle_rather_than_a_guess():
    points = marked(FOUR, pressed_rod(0.01))
    assert fit_centreline(points[:1], 92, 4, 4) is None
    assert np.isnan(fit_centreline(points[:2], 92, 4, 4).thetas[1])


@pytest.mark.parametrize("rigid", [0.0, 10.0])
def test_rigid_ends_do_not_bend(rigid):
    rod = pressed_rod(0.01, rigid=rigid)
    line = fit_centreline(marked(FOUR, rod), 92, rigid, rigid)
    assert np.ptp(line.angle[line.height <= rigid]) == pytest.approx(0, abs=1e-12)
    assert line.thetas[0] / DEG == pytest.approx(np.interp(46, rod[0], rod[2]) / DEG, abs=0.1)


def test_chords_of_an_arc():
    """On a circle a chord has the direction of the arc's middle: lower edges at 9.5, 30.5, 51.5, 72.5."""
    curvature = 0.01
    heights, places, angle = pressed_rod(curvature, rigid=0.0)
    theta1, theta2 = chord_angles(marked(FOUR, (heights, places, angle)), 92, 10)
    # the lower edge is 5 mm back along the tangent, all points alike: chords turn by 21 mm of arc
    np.testing.assert_allclose([theta1, theta2], 21 * curvature, rtol=1e-3)


def test_chords_need_all_around_the_middle():
    points = marked(FOUR, pressed_rod(0.01))
    assert np.isnan(chord_angles(points[:2], 92, 10)[0])
