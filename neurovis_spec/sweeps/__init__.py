"""Many runs of a spec: a table with a row for each point of a grid of parameters and seeds."""
