r"""Arms from a wider family than the package's model, on the chain of ``naive_arm``: nothing here imports compgen.

The M-710iC/50 as its file has it, drawn by seed: DH rows with Hayati angles, mastering, couplings, waves, gears that
give (linearly, or less and less), play (of one size, growing with the root of the load, or seated by gravity), a
Cartesian waviness and a pose noise that no source models. Warm, its nodes follow two time constants each; links grow
with the *true* exponential profile of the moment, the column with a temperature that is no node or with a node's; links
bend and twist with one node or with the difference of two; mastering drifts.

    T = B(rise) prod_i [ Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i)  bend_i(rise) ]
"""

from dataclasses import dataclass

import naive_arm
import numpy as np
from naive_arm import ALPHA, chain

DEG, MDEG, ARCSEC = np.pi / 180, np.pi / 180e3, np.pi / 648000
A, D, ZERO = naive_arm.A * 1e-3, naive_arm.D * 1e-3, naive_arm.OFFSET  # [m], [rad]
NODES = ("j2", "link1", "j3", "wrist", "face")
FINAL = np.array([11, 3.9, 13, 3, 2.3])  # K after six hours of warming, typical
CTE = 11.25e-6
COLUMN = 0.565
MASS = np.array([120, 70, 80, 25, 15, 5.0])
CENTRE = np.array([[75, 0, -150], [20, 10, 400], [100, 0, 120], [300, 0, 0], [60, 0, 0], [20, 0, 0]]) * 1e-3
PAYLOAD, PAYLOAD_CENTRE = 34.0, np.array([0.01, 0, 0.15])
#: of each bend that may be drawn: row behind which it sits, axis there, half lever
BENDS: dict[tuple[str, str], tuple[int, list[float], list[float]]] = {
    ("column", "x"): (0, [1, 0, 0], [0, 0, COLUMN / 2]), ("column", "y"): (0, [0, 1, 0], [0, 0, COLUMN / 2]),
    ("column", "twist"): (0, [0, 0, 1], [0, 0, 0]),
    ("a1", "arm"): (1, [0, 0, 1], [0.075, 0, 0]), ("a1", "side"): (1, [0, -1, 0], [0.075, 0, 0]),
    ("a2", "arm"): (2, [0, 0, -1], [0.435, 0, 0]), ("a2", "side"): (2, [0, 1, 0], [0.435, 0, 0]),
    ("a2", "twist"): (2, [1, 0, 0], [0, 0, 0]),
    ("d4", "arm"): (3, [0, 1, 0], [0, 0, 0.508]), ("d4", "side"): (3, [1, 0, 0], [0, 0, 0.508]),
    ("d4", "twist"): (3, [0, 0, -1], [0, 0, 0]),
}  # fmt: skip


def moved(w, p):
    """4 x 4 with a small rotation vector and a shift, (M, 3) each."""
    T = np.tile(np.eye(4), (len(w), 1, 1))
    x, y, z = w.T
    zero = np.zeros(len(w))
    K = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    T[:, :3, :3] += K + K @ K / 2
    T[:, :3, 3] = p
    return T


@dataclass
class WiderArm:
    """One arm, all of it drawn from a seed."""

    seed: int

    def __post_init__(self):
        rng = np.random.default_rng([self.seed, 14])
        pick = np.zeros
        self.d, self.a, self.alpha, self.beta = pick(6), pick(6), pick(6), pick(6)
        self.d[2:5] = rng.normal(0, 3e-4, 3)
        self.a[:5] = rng.normal(0, 3e-4, 5)
        self.alpha[:5] = rng.normal(0, 35 * MDEG, 5)
        self.beta[1] = rng.normal(0, 35 * MDEG)
        self.zero = np.append(0, np.append(rng.normal(0, 35 * MDEG, 4), 0))
        self.coupling = rng.normal(0, 1e-4, (6, 6)) * (rng.random((6, 6)) < 0.3)
        self.wave = rng.normal(0, 3 * MDEG, (6, 2, 2)) * np.array([1, 0.7, 0.5, 1, 1, 1])[:, None, None]
        self.ripple = [(int(rng.integers(0, 3)), int(rng.integers(5, 30)), rng.normal(0, 0.4 * MDEG), rng.uniform(0, 7))
                       for _ in range(5)]  # fmt: skip
        self.load_law = ("linear", "less and less", "linear and a link's")[self.seed % 3]
        self.give = np.abs(rng.normal(0, [0, 0.3, 0.4, 1, 1, 1])) * 1e-6
        self.play_law = ("one size", "root of the load", "seated")[(self.seed // 3) % 3]
        self.play = np.abs(rng.normal(0, [2, 1, 1.5, 3, 3, 3])) * MDEG
        self.mass = MASS * rng.uniform(0.9, 1.1, 6)
        # warmth
        self.final = FINAL * rng.uniform(0.8, 1.2, 5)
        self.fast, self.slow = rng.uniform(0.4, 1.0, 5) * 3600, rng.uniform(2.0, 5.0, 5) * 3600
        self.share = rng.uniform(0.2, 0.6, 5)  # of the fast part
        self.excess = {name: rng.normal(0, 0.12) for name in ("a2", "d4", "d6")}
        self.small_growth = rng.uniform(9, 13, 2) * 1e-6  # of a1 with j2, of a3 with j3 [1/K]
        self.column_cte = rng.uniform(9, 13) * 1e-6
        self.column_mix = np.array([1.0, 0, 0, 0, 0]) * rng.uniform(0.5, 1) if self.seed % 2 else (
            rng.dirichlet([2, 1, 1, 0.3, 0.3]) * 0.8)  # fmt: skip
        self.bends = []
        kinds = list(BENDS)
        for n, kind in enumerate(rng.choice(len(kinds), int(rng.integers(2, 5)), replace=False).tolist()):
            state = pick(5)
            first, second = rng.choice(3, 2, replace=False)  # of the warm nodes
            state[first] = 1.0
            if n % 2:  # every other one follows a difference
                state[second] = -1.0
            self.bends.append((*kinds[kind], rng.choice([-1, 1]) * rng.uniform(0.6, 2.4) * ARCSEC, state))
        self.drift = rng.normal(0, 0.02 * MDEG, (6, 5)) * (rng.random((6, 5)) < 0.2)  # of the mastering [rad/K]
        self.ripples_of_space = rng.normal(0, 5e-6, (3, 3)), rng.uniform(3, 9, (3, 3)), rng.uniform(0, 7, (3, 3))
        self.repeat = 2e-6  # rad, of each joint at each pose

    # warmth

    def rises(self, time, hours=6.0, level=1.0, ambient=0.4):
        """True rises (M, 5) [K] after times [s]; warming for some hours, then off."""

        def part(tau):
            on = np.minimum(time, hours * 3600)[:, None]
            since = np.maximum(time - hours * 3600, 0)[:, None]
            return (1 - np.exp(-on / tau)) / (1 - np.exp(-6 * 3600 / tau)) * np.exp(-since / tau)

        rise = self.final * level * (self.share * part(self.fast) + (1 - self.share) * part(self.slow))
        return rise + ambient * np.sin(2 * np.pi * time / 86400)[:, None]

    def growth(self, rise):
        """Of d1, a1, a2, a3, d4, d6, (M, 6) [m]; along a2 and d4 the profile of the very moment."""

        def falling(length, r0, r1):
            u = (np.arange(50) + 0.5) / 50
            lo, hi = np.maximum(r0, 0.05)[:, None], np.maximum(r1, 0.05)[:, None]
            return length * (lo ** (1 - u) * hi**u).mean(axis=1)

        j2, link1, j3, wrist, face = rise.T
        a2 = falling(0.1, j2, link1) + 0.65 * link1 + falling(0.12, link1, j3)
        return np.column_stack([
            self.column_cte * COLUMN * rise @ self.column_mix, self.small_growth[0] * 0.15 * j2,
            CTE * (1 + self.excess["a2"]) * a2, self.small_growth[1] * 0.17 * j3,
            CTE * (1 + self.excess["d4"]) * falling(1.016, j3, wrist),
            CTE * (1 + self.excess["d6"]) * 0.175 * (wrist + face) / 2,
        ])  # fmt: skip

    # the arm

    def _behind(self, rise):
        """What stands behind each frame: the column as it has grown, and bends."""
        none = np.zeros(len(rise))
        behind = {0: [moved(np.zeros((len(rise), 3)), np.column_stack([none, none, self.growth(rise)[:, 0]]))]}
        for link, plane, rate, state in self.bends:
            row, axis, lever = BENDS[link, plane]
            w = (rate * rise @ state)[:, None] * np.array(axis, float)
            behind.setdefault(row, []).append(moved(w, np.cross(w, lever)))
        return behind

    def torque(self, q):
        """Of gravity about each joint, (M, 6) [N m], on the nominal arm."""
        rest = np.array(chain(ZERO[None], A, D, ALPHA))[:, 0]
        frames = chain(q, A, D, ALPHA)
        loads = []
        for k in range(6):
            local = rest[k + 1, :3, :3].T @ (rest[k, :3, 3] + CENTRE[k] - rest[k + 1, :3, 3])
            loads.append((k + 1, self.mass[k], frames[k + 1][:, :3, 3] + frames[k + 1][:, :3, :3] @ local))
        loads.append((6, PAYLOAD, frames[6][:, :3, 3] + frames[6][:, :3, :3] @ PAYLOAD_CENTRE))
        torque = np.zeros((len(q), 6))
        for i in range(6):
            axis, origin = frames[i][:, :3, 2], frames[i][:, :3, 3]
            for row, mass, place in loads:
                if row > i:
                    torque[:, i] += (axis * np.cross(place - origin, [0, 0, -9.80665 * mass])).sum(axis=1)
        return torque

    def flange(self, q, rise, side, rng=None):
        """Where the flange really is, (M, 4, 4), for commanded DH joints, rises and the side each joint came from."""
        tau = self.torque(q)
        give = self.give * tau
        if self.load_law == "less and less":
            give = self.give * 600 * np.tanh(tau / 600) * 1.2
        play = self.play * side
        if self.play_law == "root of the load":
            play = self.play * side * (0.5 + np.sqrt(np.abs(tau) / 400))
        elif self.play_law == "seated":
            seat = np.tanh(tau / 300)
            play = self.play * (side * (1 - 0.7 * np.abs(seat)) - seat)
        angle = q + self.zero + (q - ZERO) @ self.coupling.T + give - play + rise @ self.drift.T
        for n in (1, 2):
            angle = angle + self.wave[:, n - 1, 0] * np.sin(n * q) + self.wave[:, n - 1, 1] * np.cos(n * q)
        for joint, order, size, phase in self.ripple:
            angle[:, joint] += size * np.sin(order * q[:, joint] + phase)
        if rng is not None:
            angle = angle + rng.normal(0, self.repeat, q.shape)
        grown = self.growth(rise)
        d, a = np.tile(D + self.d, (len(q), 1)), np.tile(A + self.a, (len(q), 1))
        a[:, 0] += grown[:, 1]
        a[:, 1] += grown[:, 2]
        a[:, 2] += grown[:, 3]
        d[:, 3] -= grown[:, 4]
        d[:, 5] -= grown[:, 5]
        alpha = ALPHA + self.alpha
        if self.load_law == "linear and a link's":  # the upper arm itself twists a little under the payload
            d = d + np.outer(tau[:, 1] / 3000, [0, 0, 1, 0, 0, 0]) * 20e-6
        T = chain(angle, a, d, alpha, self.beta, self._behind(rise))[6]
        sizes, orders, phases = self.ripples_of_space
        for k in range(3):
            T[:, :3, 3] += sizes[k] * np.sin(orders[k] * T[:, [k], 3] + phases[k])
        return T

    def true_values(self):
        """What the package's parameters should be, by table, field and index, as far as the two families meet."""
        truth: dict[tuple[str, str, tuple[int, ...]], float] = {
            ("link_offsets", "d", (i,)): self.d[i] for i in range(2, 5)
        }
        for name, row in (("a", self.a), ("alpha", self.alpha)):
            truth |= {("link_offsets", name, (i,)): row[i] for i in range(5)}
        truth["link_offsets", "beta", (1,)] = self.beta[1]
        truth |= {("joint_zeros", "offset", (i,)): self.zero[i] for i in range(1, 5)}
        truth |= {("joint_coupling", "ratio", (i, j)): self.coupling[i, j] for i in range(6) for j in range(6)}
        for n in range(2):
            for s, name in enumerate(("sine", "cosine")):
                truth |= {("gear_harmonics", name, (i, n)): self.wave[i, n, s] for i in range(6)}
        truth["thermal_growth", "excess_a", (1,)] = self.excess["a2"]
        truth["thermal_growth", "excess_d", (3,)] = self.excess["d4"]
        truth["thermal_growth", "excess_d", (5,)] = self.excess["d6"]
        return truth
