"""Uncertainty: from priors of assumed parameters to bands of results and what they hang on."""
