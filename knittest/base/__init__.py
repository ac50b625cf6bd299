"""What every other package reads and none decides: errors, units, files, progress, what a simulation leaves behind."""
