"""Routes: how connections run once neurons have their places.

In: centres, edges, and what an engine knows about the way (waypoints). Out: a cubic spline for every edge. Routes are
found, as ``curves`` (along the direction), ``bows`` (from anywhere to anywhere), ``detours`` (round frames and discs),
improved (``improve``) by what they cost among all that is drawn (``route_cost``), and joined by ``loops`` (to itself).
"""

from neurovis_layouts.routing.router import RoutePlan, Surroundings, Waypoint, route_all

__all__ = ["RoutePlan", "Surroundings", "Waypoint", "route_all"]
