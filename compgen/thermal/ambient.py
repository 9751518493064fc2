r"""The air around the robot over time, and what it alone does to a first-order mode.

The air's rise above the reference temperature is a line from knot to knot plus one wave,

    u(t) = piecewise linear(t) + a cos(w (t - t_peak))

and a mode that follows it, dz/dt = rate (u - z), z(t_0) = 0, is solved exactly: on a straight piece c + s (t - t_a) the
particular solution is c + s (t - t_a) - s / rate, for the wave a Re[H exp(i w (t - t_peak))], H = rate / (rate + i w).
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from compgen.core.arrays import Array, cumulated, owns
from compgen.core.units import DAY


@dataclass(frozen=True, eq=False, slots=True)
@owns(time=("Q",), rise=("Q",))
class Ambient:
    """Rise of the air above the temperature at which the robot counts as cold."""

    time: Array  # (Q,) [s] of the knots, rising; before the first and after the last the air holds still
    rise: Array  # (Q,) [K]
    amplitude: float = 0.0  # [K] of the wave
    period: float = DAY  # [s]
    peak: float = 0.0  # [s] when the wave is highest

    @property
    def is_still(self) -> bool:
        """Always at the reference."""
        return not (self.rise.any() or self.amplitude)

    def moves_after(self, moment: float) -> bool:
        """Whether it changes after a moment [s]."""
        rise = np.append(self.rise[self.time > moment], np.interp(moment, self.time, self.rise))
        return bool(self.amplitude or np.ptp(rise))

    def since(self, moment: float) -> "Ambient":
        """The same air on a clock that begins at a moment [s] of this one."""
        return replace(self, time=self.time - moment, peak=self.peak - moment)

    def at(self, time: Array) -> Array:
        """Rise of the air, (M,) [s] to (M,) [K]."""
        w = 2 * np.pi / self.period
        return np.interp(time, self.time, self.rise) + self.amplitude * np.cos(w * (np.asarray(time) - self.peak))

    def integral(self, time: Array) -> Array:
        """Of the rise from a fixed moment on, (M,) [s] to (M,) [K s]; differences of it count."""
        w = 2 * np.pi / self.period
        to_knots = cumulated(np.diff(self.time) * (self.rise[1:] + self.rise[:-1]) / 2)
        knot = (np.searchsorted(self.time, time, side="right") - 1).clip(0)
        height = (self.rise[knot] + np.interp(time, self.time, self.rise)) / 2
        ramps = to_knots[knot] + height * (time - self.time[knot])
        return np.asarray(ramps + self.amplitude / w * np.sin(w * (time - self.peak)))

    def seen_from(self, clocks: Array, span: float) -> "Ambient":
        """The mean of this air over several clocks (R,) [s], as time from each of them on, for ``span`` [s]."""
        w = 2 * np.pi / self.period
        knots = (self.time - clocks[:, None]).ravel()
        knots = np.unique(np.concatenate([[0.0, span], knots[(knots > 0) & (knots < span)]]))
        rise = sum(np.interp(clock + knots, self.time, self.rise) for clock in clocks.tolist()) / len(clocks)
        turn = complex(np.exp(1j * w * (clocks - self.peak)).mean())
        return Ambient(knots, np.asarray(rise), self.amplitude * abs(turn), self.period, -float(np.angle(turn)) / w)

    def response(self, rate: Array, start: float, time: Array) -> Array:
        """What the air does to modes that stood at zero at ``start``.

        Args:
            rate: Of each mode, (S,) [1/s].
            start: [s].
            time: Rising, none before ``start``, (M,) [s].

        Returns:
            (M, S) [K].
        """
        if self.is_still or len(time) == 0:
            return np.zeros((len(time), len(rate)))
        inside = (self.time > start) & (self.time < time[-1])
        edges = np.concatenate([[start], self.time[inside], [max(time[-1], start)]])
        level, length = np.interp(edges, self.time, self.rise), np.diff(edges)[:, None]
        slope = np.diff(level)[:, None] / np.where(length > 0, length, np.inf)
        decay, kick = np.exp(-rate * length), np.diff(slope, axis=0, prepend=0.0) / rate
        decaying = np.empty_like(kick)  # of each piece, at its begin: the mode less its particular solution
        decaying[0] = kick[0] - level[0]
        for k in range(1, len(kick)):
            decaying[k] = decaying[k - 1] * decay[k - 1] + kick[k]
        piece = np.searchsorted(edges[1:-1], time, side="right")
        since = (time - edges[piece])[:, None]
        ramp = level[piece][:, None] + slope[piece] * since - slope[piece] / rate
        return np.asarray(ramp + decaying[piece] * np.exp(-rate * since) + self._wave(rate, start, time))

    def settled(self, rate: Array) -> Array:
        """Modes at time zero that have followed the air for long before, (S,) [K]."""
        w = 2 * np.pi / self.period
        wave = self.amplitude * rate / (rate + 1j * w) * np.exp(-1j * w * self.peak)
        return np.asarray(np.interp(0.0, self.time, self.rise) + wave.real)

    def _wave(self, rate: Array, start: float, time: Array) -> Array:
        w = 2 * np.pi / self.period
        gain = self.amplitude * rate / (rate + 1j * w)

        def forced(t: Array) -> Array:
            return np.asarray((gain * np.exp(1j * w * (t - self.peak))[:, None]).real)

        return np.asarray(forced(time) - forced(np.array([start])) * np.exp(-rate * (time - start)[:, None]))


@cache
def still_air(rise: float = 0.0) -> Ambient:
    """Air that stays as it is, by default at the reference temperature."""
    return Ambient(np.zeros(1), np.array([rise]))
