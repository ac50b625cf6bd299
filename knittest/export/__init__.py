"""What a run leaves behind: run folder, summary, VTU frames and pictures."""
