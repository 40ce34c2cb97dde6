"""The room in which a network meets ROS: a node that runs it, and what listens to one.

Which ROS there is, is known to ``ros1`` and ``ros2`` alone; everything else works with ``middleware``.
"""
