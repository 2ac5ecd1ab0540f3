"""Studies over designs: the paper's comparisons and the judging of its claims."""
