"""Vision: from camera frames to the bending angle, the centreline and the level of the fluid columns.

The finger bends in one plane. A calibrated camera and a calibrated bending plane turn every pixel into a
point of that plane [mm]; a marker's pose in the plane is found by aligning its ideal picture with the
pixels themselves.

Plane coordinates: x to the right in the bending plane, z up along the finger, base of the finger at z = 0.
An angle is positive when it turns counter-clockwise in the picture, so that a finger bending towards -x
bends by a positive angle.
"""
