"""What a picture can show: the names of the views."""

VIEWS = ("network", "matrix", "traces", "raster", "weights", "body")
#: Those over the time of a run.
TIMED = ("traces", "raster", "weights")
#: Those that show the whole of something, and take no references.
WHOLE = ("network", "body")
