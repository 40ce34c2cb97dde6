"""Makes the data of hexapod.yaml: what its legs meet on their way, as the body or a simulation would tell.

obstacle.csv: 1 while a beam lies in the way of a leg. floor_left.csv, floor_right.csv: how firmly the floor bears a
leg. One row a step of 0.025 s, one column a leg of a side: front, middle, hind. The last row
stays. Run it in this folder: python make_data.py
"""

import csv
from pathlib import Path

#: Beams across the way, the same for both sides: the step at which the front legs meet the first one, steps from one to
#: the next, how many.
FIRST, EVERY, BEAMS = 603, 180, 8
#: Steps until the front, the middle and the hind leg are there; steps in which a leg is past, a stride.
LATER, PASSING = (0, 65, 100), 20

#: From SOFT on the floor is soft for all legs but the right front one, from WHOLLY on for that one, too.
SOFT, WHOLLY = 2100, 2500
#: How firmly the two floors bear.
RIGID_FLOOR, SOFT_FLOOR = 1, 0.67


def obstacle(step, leg):
    """1 while a beam lies in the way of a leg of either side."""
    since = step - FIRST - LATER[leg]
    return int(0 <= since < EVERY * BEAMS and since % EVERY < PASSING)


def floor_left(step, leg):
    """How firmly the floor bears a left leg."""
    return SOFT_FLOOR if step >= SOFT else RIGID_FLOOR


def floor_right(step, leg):
    """How firmly the floor bears a right leg."""
    return SOFT_FLOOR if step >= (WHOLLY if leg == 0 else SOFT) else RIGID_FLOOR


def write(value, last):
    """Write a table, one row a step as far as the last one; it is named like the function that gives its values."""
    with Path(__file__).with_name(f"{value.__name__}.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["front", "middle", "hind"])
        writer.writerows([value(step, leg) for leg in range(3)] for step in range(last + 1))


if __name__ == "__main__":
    write(obstacle, FIRST + (BEAMS - 1) * EVERY + LATER[-1] + PASSING)
    write(floor_left, SOFT)
    write(floor_right, WHOLLY)
