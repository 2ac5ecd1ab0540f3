"""Makes the test meshes of `mapped_box.py` importable from every folder of tests."""
