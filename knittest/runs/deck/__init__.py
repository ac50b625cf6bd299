"""Input decks for other solvers: a prepared specimen with its motion, contact and output."""
