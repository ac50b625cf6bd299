"""Many runs in processes of their own: of a command and its repeats, sweeps, calibrations, regressions, studies."""
