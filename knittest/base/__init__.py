"""Foundation that every other package reads: errors, units, files, progress, the record of a simulation."""
