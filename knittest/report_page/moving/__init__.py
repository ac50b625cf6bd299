"""Moving pictures of a run folder: ``view.html`` for a browser, and films."""
