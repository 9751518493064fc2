"""Constants, typed by hand from where they are published, each with its place.

*line* is a line of the study (README.md names it), *errata* what its contradictions come to; *urdf* is ROS-Industrial's
``fanuc_m710ic_support``, whose limits are from the maker's manual B-82274EN/09; *assumed* is published nowhere, and the
package assumes the same. A misprint of the study that was read wrongly by both would pass.
"""

import numpy as np

# The arm, DH after Denavit and Hartenberg: rz(theta) tz(d) tx(a) rx(alpha).
D_MM = (0.0, 0.0, 0.0, -1016.0, 0.0, -175.0)  # Table 2, lines 950-955; urdf 1.016, 0.175
A_MM = (150.0, 870.0, 170.0, 0.0, 0.0, 0.0)  # Table 2, lines 950-955; urdf
# Table 2, lines 950-955, but for the last, 0 there: $DH_ALPHA[6] = pi on controllers, tool z points out of the wrist
ALPHA = tuple(np.radians((-90.0, 180.0, -90.0, 90.0, -90.0, 180.0)))
# theta1 = J1, theta2 = J2 - 90 deg, theta3 = J2 + J3: the pendant's J3 is the forearm's angle to the horizontal (urdf,
# J23_factor = 1), theta4 = J4, theta5 = J5, theta6 = J6
THETA2_AT_ZERO = np.radians(-90.0)
LOWER_DEG = (-180.0, -180.0, -160.0, -360.0, -125.0, -360.0)  # of theta; urdf, J2 from -90
UPPER_DEG = (180.0, 45.0, 280.0, 360.0, 125.0, 360.0)  # urdf, J2 to 135
# of theta; J1 to J3: the least in public tables of an M-710iC/70, 5.68, 6.52 and 8.06 rad/s2; the others assumed
ACCELERATION_DEG_S2 = (325.0, 373.0, 461.0, 400.0, 400.0, 500.0)
JERK_DEG_S3 = (1625.0, 1865.0, 2305.0, 2000.0, 2000.0, 2500.0)  # 0.2 s to each
PERIOD_S = 0.008  # of interpolation, $SCR.$ITP_TIME; lines last whole ones, as the maker's motion code has them
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share that a ramp from and to a stop uses; assumed

# How lengths grow: dL = cte sum over millimetres of link of its rise (equation 8, line 1003).
CTE_1_K = 11.25e-6  # line 800, effective
NODES = ("j2", "link1", "j3", "wrist", "face")
REFERENCE_FEED_MM_S, REFERENCE_S = 200.0, 6 * 3600.0  # line 1045
REFERENCE_RISE_K = {
    "j2": 11.0,  # line 1053, base joint
    "link1": 3.9,  # line 1053, "just less than 4"
    "j3": 13.0,  # lines 1045, 1053, 1055
    "wrist": 3.0,  # line 1055
    "face": 2.3,  # line 1057
}
#: link, its DH number, and sections to a distance from its base end [mm] between two nodes
LINKS = (
    # lines 1053, 1055 with errata: exponential over 100 mm, constant to 750 mm, exponential to the end
    (
        "a2",
        ((100, "j2", "link1", "exponential"), (750, "link1", "link1", "linear"), (870, "link1", "j3", "exponential")),
    ),
    ("d4", ((1016, "j3", "wrist", "exponential"),)),  # line 1055, figure 65
    ("d6", ((175, "wrist", "face", "linear"),)),  # line 1057, "linear at 0.7"
)

# How warm: what the study quotes, node, feed [mm/s], hours, rise [K].
TABLE_3, TABLE_4, TABLE_5 = 120.0, 77.0, 360.0  # minutes over which rates hold: lines 1546, 1562, 1575
QUOTED = (
    ("j3", 200, 6.0, 13.0),  # line 1053
    ("j3", 200, 6.0, 12.0),  # line 1691
    ("j3", 200, 6.5, 14.0),  # line 1444
    ("j2", 200, 6.0, 11.0),  # line 1053
    ("link1", 200, 6.0, 3.9),  # line 1053
    ("wrist", 200, 6.0, 3.0),  # line 1055
    ("j3", 100, 77 / 60, 2.5),  # line 1691, spiral
    ("j3", 100, 77 / 60, 0.0423 * TABLE_4),  # Table 4, line 1564
    ("j3", 100, 77 / 60, 2.5 + 0.5),  # line 1575, circle is "about 0.5 hotter"
    ("j2", 100, 77 / 60, 0.0214 * TABLE_4),  # Table 4, line 1562, printed 0.214 (errata)
    ("j2", 100, 6.0, 0.0214 * TABLE_5),  # Table 5, line 1578, printed 0.214 (errata)
    ("link1", 100, 77 / 60, 0.0085 * TABLE_4),  # Table 4, line 1563
    ("link1", 100, 6.0, 0.0101 * TABLE_5),  # Table 5, line 1579
    ("wrist", 100, 77 / 60, 0.0061 * TABLE_4),  # Table 4, line 1565, printed 0.061 (errata)
    ("wrist", 100, 6.0, 0.008 * TABLE_5),  # Table 5, line 1581
    ("j3", 20, 2.0, 2.2),  # line 1530, X line
    ("j3", 20, 2.0, 2.5),  # line 1538, Y line
    ("j3", 20, 94 / 60, 2.1),  # lines 1490 and 1492, Z line
    ("j3", 20, 2.0, 0.0288 * TABLE_3),  # Table 3, line 1555
    ("j2", 20, 2.0, 0.0106 * TABLE_3),  # Table 3, line 1553
    ("link1", 20, 2.0, 0.01 * TABLE_3),  # Table 3, line 1554
    ("wrist", 20, 2.0, 0.0074 * TABLE_3),  # Table 3, line 1556
    ("j3", 0, 16.0, 1.0),  # line 1428 with errata: what is left 16 h after the reference
)
COOLING_H, COOLING_WIDTH = 5.91, 0.25  # line 1428 with errata, the whole robot: known to a quarter, assumed
SENSOR_K = 0.3  # of one quoted temperature against another; assumed
# How well all that is known.
LAW_K = 0.49  # of a node's rise: the 24 temperatures each left out in turn (docs/validation.md)
SENSORS_K = 0.5  # alike for all: docs/uncertainty.md derives it from lines 661 to 697 and 1526
AIR_K = 0.25  # line 1526: 0.5 K in 40 h, two standard deviations
FEED = 0.01  # assumed
CTE_OPEN_1_K = (10e-6, 15e-6)  # line 800, steel and iron
GROWTH_OPEN_PERCENT = ((-2.4, 0.0), (-18.8, 0.0), (-2.9, 0.0))  # of a2, d4, d6 by conduction: docs/heat.md
MISSING = 0.05  # of the thermal error; assumed
UNKNOWN_UM = {
    "cold geometry": (300.0, 746.0),  # lines 1127 and 1470
    "play": (55.0, 175.0),  # half of the hystereses of lines 1609 and 1627
    "repeatability": (25.0, 100.0),  # lines 1121 and 1183
    "the first lap": (500.0, 1500.0),  # line 1183
}
UNKNOWN_WITHOUT_FIGURE = ("part's frame", "tool length", "payload and sag", "process force", "floor and base tilt")
BEND_ARCSEC_K = 2.4  # line 266: 28.8 arcsec for 12 K
WIDTH_SPREAD = 0.7  # of the logarithm of a reversal's width that nobody measured; assumed
WARM_K = 1.0  # rise from which sensors that are off were off when a frame was taught, too; assumed
IDLE = 0.05  # of the reference's heat with the servo on and standing; assumed
