"""Layout engines: each takes a LayoutProblem and gives back a Layout."""
