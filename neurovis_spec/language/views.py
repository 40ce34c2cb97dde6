"""What a picture can show: the names of the views."""

VIEWS = ("network", "matrix", "traces", "raster", "weights")
