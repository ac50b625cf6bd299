"""Picture frame: a square of fabric is sheared by four hinged sides."""
