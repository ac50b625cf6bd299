"""What each test shows: comparison with its references, curves and pictures of the run folder."""
