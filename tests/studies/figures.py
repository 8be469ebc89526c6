"""Figures that src/study/stats/tests.rs, src/scenario/sampling and src/session/summary.rs hold against: run with
scipy 1.x.

    pip install scipy && python3 tests/studies/figures.py
"""
import numpy as np
from scipy import stats
from scipy.special import expit, logit
from scipy.stats import binomtest, norm, truncnorm, triang, lognorm, qmc, beta

def show(name, value):
    print(f"{name}: {value!r}")

# A sample without luck: quantiles of a skew distribution.
x = [round(float(v), 6) for v in stats.gamma(2).ppf((np.arange(40) + 0.5) / 40)]
show("sample", x)
a = np.array(x)
show("mean", (a.mean(), *stats.t.interval(0.95, len(a) - 1, a.mean(), stats.sem(a))))
# The same within bounds: even in the logarithm, and in the logit (delta method).
t = stats.t.ppf(0.975, len(a) - 1)
m, half = a.mean(), t * stats.sem(a)
shares = np.exp(-0.05 * a)
ms, slope = shares.mean(), 1 / (shares.mean() * (1 - shares.mean()))
ends = [float(expit(logit(ms) + sign * t * stats.sem(shares) * slope)) for sign in (-1, 1)]
show("bounded", [float(m * np.exp(-half / m)), float(m * np.exp(half / m)), float(ms), *ends])
for p in (0.5, 0.9, 0.95):
    r = stats.quantile_test(a, q=0, p=p).confidence_interval(0.95)
    show(f"quantile {p}", (float(np.quantile(a, p)), r.low, r.high))
for k, n in ((0, 20), (3, 20), (17, 400), (20, 20), (1, 100000)):
    t = binomtest(k, n)
    w, c = t.proportion_ci(method="wilson"), t.proportion_ci(method="exact")
    show(f"rate {k}/{n}", (w.low, w.high, c.low, c.high))
y = [round(float(v), 6) for v in np.sin(np.arange(40)) + a]
show("y", y)
show("spearman", stats.spearmanr(a, y).statistic)
ties = [1, 2, 2, 3, 3, 3, 4, 5, 5, 6]
other = [2, 1, 3, 3, 5, 4, 4, 6, 8, 7]
show("spearman ties", stats.spearmanr(ties, other).statistic)
d = np.array(y) - a
# Kelley's epsilon squared by the F of an analysis of variance.
shifted = np.array(y) + np.array([0.0, 2.0, 1.0])[np.arange(40) % 3]
f = stats.f_oneway(*(shifted[np.arange(40) % 3 == g] for g in range(3))).statistic
show("epsilon squared", float(2 * (f - 1) / (2 * f + 37)))
show("paired", (d.mean(), *stats.t.interval(0.95, 39, d.mean(), stats.sem(d))))

# Quantiles of distributions: u = 1e-6, 0.1, 0.5, 0.999.
u = [1e-6, 0.1, 0.5, 0.999]
show("normal 3 2", [float(v) for v in norm(3, 2).ppf(u)])
show("truncated -1..2 of 0 1", [float(v) for v in truncnorm(-1, 2).ppf(u)])
show("truncated over 6 of 0 1", [float(v) for v in truncnorm(6, np.inf).ppf(u)])
show("lognormal 2 0.5", [float(v) for v in lognorm(0.5, scale=2).ppf(u)])
show("triangular 1 2 5", [float(v) for v in triang(0.25, 1, 4).ppf(u)])
show("ln density of truncated -1..2 at 0.5", float(truncnorm(-1, 2).logpdf(0.5)))
show("ln density of lognormal 2 0.5 at 3", float(lognorm(0.5, scale=2).logpdf(3)))
show("ln density of triangular 1 2 5 at 3", float(triang(0.25, 1, 4).logpdf(3)))
show("Sobol points", [[float(v) for v in row] for row in qmc.Sobol(5, scramble=False).random(16)])
show("P(N(0, 2) > 6.0316)", float(norm.sf(6.0316 / 2**0.5)))
show("percentiles of 5 1 4 2", [float(v) for v in np.percentile([5, 1, 4, 2], [50, 75, 95])])
