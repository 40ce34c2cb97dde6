"""The runtime: the reference interpreter, backends, simulation, recording."""
