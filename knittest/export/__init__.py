"""Files of a run: run folder, summary, VTU frames and pictures."""
