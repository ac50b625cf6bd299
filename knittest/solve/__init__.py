"""Moves a model and books its energy: rigs, the time loop, relaxation, what stops them; kernels compiled before."""
