// How the energy of a contact depends on its distance, and the mollifier of nearly parallel edges.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "contact/vec3.hpp"

namespace qlb {

// A function of one variable with its first and second derivatives.
struct Derivatives {
  double value = 0.0, first = 0.0, second = 0.0;
};

// beta(s) = -(s - 1)^2 ln s for s < 1, of class C2 at 1 (Li et al. 2020, "Incremental Potential Contact", eq. 6).
// Infinite for s <= 0, with derivatives of zero there: nothing is to be done with them.
inline Derivatives log_barrier(double s) {
  if (s >= 1.0) return {};
  if (s <= 0.0) return {std::numeric_limits<double>::infinity(), 0.0, 0.0};
  const double r = s - 1.0, ln = std::log(s), q = r / s;
  return {-r * r * ln, -r * (2.0 * ln + q), -2.0 * ln - 4.0 * q + q * q};
}

// (s - 1)^2 / 2 for s < 1: a spring that resists however deep.
inline Derivatives quadratic_penalty(double s) {
  const double r = s - 1.0;
  return r < 0.0 ? Derivatives{0.5 * r * r, r, 1.0} : Derivatives{};
}

// m(c) = (2 - c/eps) c/eps for c < eps, else 1, with c = |e1 x e2|^2: takes the energy of two edges to zero, smoothly,
// where they are parallel and their closest points jump (Li et al. 2020, eq. 17).
struct Mollifier {
  Derivatives m{1.0, 0.0, 0.0};   // in c
  Vec3 e1, e2, normal;            // normal = e1 x e2
  std::array<Vec3, 2> c_slope{};  // dc/de1, dc/de2

  bool active() const { return m.first != 0.0; }
};

// x: the ends of the first edge, then those of the second; threshold: eps.
inline Mollifier edge_mollifier(const std::array<Vec3, 4>& x, double threshold) {
  Mollifier out;
  out.e1 = x[1] - x[0];
  out.e2 = x[3] - x[2];
  out.normal = cross(out.e1, out.e2);
  const double ratio = dot(out.normal, out.normal) / threshold;
  if (!(ratio < 1.0)) return out;
  out.m = {(2.0 - ratio) * ratio, 2.0 * (1.0 - ratio) / threshold, -2.0 / (threshold * threshold)};
  out.c_slope = {2.0 * cross(out.e2, out.normal), 2.0 * cross(out.normal, out.e1)};
  return out;
}

}  // namespace qlb
