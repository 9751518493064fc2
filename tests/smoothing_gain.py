"""What a controller's smoothing passes of a wave, by the formula alone: an oracle of those tests that need one."""

import numpy as np


def passed(motion, w):
    """H(w) in continuous time, delays removed: prod sinc(w T / 2) prod 1 / sqrt(1 + w^2 T^2), (F,) of (F,) [rad/s]."""
    w = np.asarray(w, dtype=float)
    gain = np.ones_like(w)
    for window in motion.moving_averages:
        gain = gain * np.sinc(w * window / (2 * np.pi))
    for constant in motion.first_orders:
        gain = gain / np.sqrt(1 + (w * constant) ** 2)
    return gain
