"""The bench: its clock, messages, link, rig, recorder. Needs no simulator and no finite elements."""
