"""The words of which some values are one, for those who read them behind the language.

In: nothing. Out: types and tables; the models take their words from here.
"""

from typing import Literal

Direction = Literal["down", "up", "right", "left"]
Combine = Literal["sum", "product", "distance"]
NeuronRole = Literal["input", "hidden", "output"]
Reliability = Literal["reliable", "best_effort"]
Durability = Literal["volatile", "transient_local"]
OnTimeout = Literal["hold", "zero", "stop"]

#: What a picture can show.
VIEWS = ("network", "matrix", "traces", "raster", "weights", "body")
#: Those over the time of a run.
TIMED = ("traces", "raster", "weights")
#: Those that show the whole of something, and take no references.
WHOLE = ("network", "body")
