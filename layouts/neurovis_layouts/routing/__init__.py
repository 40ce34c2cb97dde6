"""Routes: how connections run once neurons have their places.

In: centres, edges, and what an engine knows about the way (waypoints). Out: a cubic spline for every edge. The
modules: ``ports`` (who leaves and arrives where on a disc), ``curves`` (along the direction), ``bows`` (from anywhere
to anywhere), ``loops`` (to itself), ``obstacles`` (which neurons are in the way), ``parallel_edges`` (those that
share both ends), ``end_separation`` (which keep off departures).
"""

from neurovis_layouts.routing.router import Waypoint, route_all, told_apart

__all__ = ["Waypoint", "route_all", "told_apart"]
