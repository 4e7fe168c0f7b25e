"use strict";
// The functions by which coordinates move bodies, as docs/urdf.md describes them: law(data)(x) is a number.
(() => {
  const polynomial = (coefficients, t) => {
    let total = 0;
    for (let k = coefficients.length - 1; k >= 0; k--) total = total * t + coefficients[k];
    return total;
  };

  // How many of the increasing numbers xs are not greater than x.
  const reached = (xs, x) => {
    let low = 0, high = xs.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (x < xs[middle]) high = middle; else low = middle + 1;
    }
    return low;
  };

  const LAWS = {
    "constant": (f) => () => f.value,
    "linear": (f) => (x) => f.slope * x[0] + f.start,
    "weighted-sum": (f) => (x) => f.weights.reduce((sum, weight, k) => sum + weight * x[k], f.start),
    "polynomial": (f) => (x) => polynomial(f.coefficients, x[0]),
    "sine": (f) => (x) => f.amplitude * Math.sin(f.omega * x[0] + f.phase) + f.offset,
    "step": (f) => (x) => {
      const t = Math.min(Math.max((x[0] - f.x[0]) / (f.x[1] - f.x[0]), 0), 1);
      return f.y[0] + (f.y[1] - f.y[0]) * t * t * t * (10 - 15 * t + 6 * t * t);
    },
    "multivariate-polynomial": (f) => (x) => f.coefficients.reduce(
      (sum, c, k) => sum + f.powers[k].reduce((product, power, i) => product * x[i] ** power, c), 0),
    "scaled": (f) => {
      const inner = law(f.function);
      return (x) => f.scale * inner(x);
    },
    "piecewise-linear": (f) => (x) => {
      const k = Math.min(Math.max(reached(f.x, x[0]) - 1, 0), f.x.length - 2);
      return f.y[k] + (f.y[k + 1] - f.y[k]) / (f.x[k + 1] - f.x[k]) * (x[0] - f.x[k]);
    },
    "piecewise-constant": (f) => (x) => f.y[Math.max(reached(f.x, x[0]) - 1, 0)],
    "piecewise-polynomial": (f) => (x) => {
      const k = reached(f.x, x[0]);
      return polynomial(f.pieces[k], x[0] - f.x[Math.max(k - 1, 0)]);
    },
    "ellipsoid-point": (f) => (x) => f.radius * [
      Math.sin(x[1]), -Math.sin(x[0]) * Math.cos(x[1]), Math.cos(x[0]) * Math.cos(x[1])][f.component],
    "arc-point": (f) => (x) => {
      const a = x[0] + f.neutral[0], b = x[1] + f.neutral[1];
      const t = Math.acos(Math.cos(a) * Math.cos(b)), across = t < 1e-4 ? 0.5 : (1 - Math.cos(t)) / (t * Math.sin(t));
      return f.length * [-across * Math.sin(b), t < 1e-4 ? 1 : Math.sin(t) / t, across * Math.sin(a) * Math.cos(b)][f.component];
    },
  };

  // The function that data describes; that of null is its first argument.
  const law = (data) => data === null ? (x) => x[0] : LAWS[data.type](data);

  Object.assign(window.osimlite, { law });
})();
