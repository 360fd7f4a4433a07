"""Naive twins of the production codec's kernels, written only to be read."""

import numpy as np

N_SYMBOLS = 16
TOTAL_BITS = 15


class NaiveWriter:
    """A range coder whose low end is one number of any length: carries look after themselves."""

    def __init__(self):
        self.low = 0
        self.width = 2**32 - 1
        self.n_bytes = 4

    def narrow(self, below, parts, n_bits):
        part = self.width >> n_bits
        self.low += part * below
        self.width = part * parts
        while self.width < 2**24:
            self.low *= 256
            self.width *= 256
            self.n_bytes += 1

    def finish(self):
        for spare_bytes in (4, 3, 2, 1, 0):
            unit = 256**spare_bytes
            value = -(-self.low // unit) * unit
            if value < self.low + self.width:
                return value.to_bytes(self.n_bytes, "big").rstrip(b"\0")
        raise AssertionError


class NaiveModel:
    """Two cumulative distributions that move towards what comes, by 1/16 and by 1/64."""

    def __init__(self, probabilities):
        room = 2**TOTAL_BITS - N_SYMBOLS
        cumulative = [0]
        total = 0.0
        for i, probability in enumerate(probabilities):
            total += probability
            cumulative.append(int(room * total) + i + 1)
        cumulative[-1] = 2**TOTAL_BITS
        self.fast, self.slow = list(cumulative), list(cumulative)

    def below(self, symbol):
        return (self.fast[symbol] + self.slow[symbol]) // 2

    def learn(self, symbol):
        for i in range(1, N_SYMBOLS):
            goal = 2**TOTAL_BITS - N_SYMBOLS + i if i > symbol else i
            self.fast[i] += (goal - self.fast[i]) // 16
            self.slow[i] += (goal - self.slow[i]) // 64


def naive_symbols(symbols, probabilities):
    """The bytes of symbols coded by one model."""
    writer, model = NaiveWriter(), NaiveModel(probabilities)
    for symbol in symbols:
        below = model.below(symbol)
        writer.narrow(below, model.below(symbol + 1) - below, TOTAL_BITS)
        model.learn(symbol)
    return writer.finish()


def naive_spline(coefficients, spacing, n_frames):
    """A uniform cubic B-spline at the frames, one basis function at a time."""

    def basis(x):
        x = abs(x)
        if x < 1:
            return 2 / 3 - x**2 + x**3 / 2
        return (2 - x) ** 3 / 6 if x < 2 else 0.0

    if spacing == 1:
        return np.array(coefficients, dtype=float)
    return np.array(
        [
            sum(c * basis(t / spacing - (k - 1)) for k, c in enumerate(coefficients))
            for t in range(n_frames)
        ]
    )


def naive_metric(skeleton, values, places_of):
    """J.T @ J (F, C, C) by differences; `places_of` gives points (F, P, 3) of channels."""
    step = 1e-5
    columns = []
    for channel in range(values.shape[1]):
        ahead, behind = values.copy(), values.copy()
        ahead[:, channel] += step
        behind[:, channel] -= step
        columns.append((places_of(skeleton, ahead) - places_of(skeleton, behind)) / (2 * step))
    jacobian = np.stack(columns, axis=-1).reshape(len(values), -1, values.shape[1])
    n_points = jacobian.shape[1] // 3
    return np.swapaxes(jacobian, 1, 2) @ jacobian / n_points
