"""Figures and the self-contained report page, drawn from the files of run directories only."""
