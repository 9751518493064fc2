"""The only conversion factors. Multiply by a unit to come in, divide by it to go out."""

from math import pi

MM = 1e-3  # m
UM = 1e-6  # m
DEG = pi / 180  # rad
MDEG = DEG / 1000  # rad
HOUR = 3600.0  # s
DAY = 24 * HOUR  # s
MS = 1e-3  # s
INCH = 25.4e-3  # m
MINUTE = 60.0  # s
KB = 1000.0  # bytes
MB = 1000 * KB  # bytes
URAD = 1e-6  # rad
PPM = 1e-6  # parts per million
PERCENT = 0.01
