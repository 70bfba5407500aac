// Closest points of a point and a triangle, and of two segments, for any input: parallel, flat, of no length.
//
// Over the four nodes of a pair, the vector between the closest points is w = sum_i gamma_i x_i, gamma being convex
// weights on one side and minus convex weights on the other. The distance d = |w| is a minimum over the weights, so
// that dd/dx_i = gamma_i w/d (envelope theorem): the weights need no derivative.
#pragma once

#include <algorithm>
#include <array>

#include "contact/vec3.hpp"

namespace qlb {

struct ClosestPoints {
  std::array<double, 4> gamma{};
  Vec3 apart;            // w, from the second primitive to the first
  double distance2 = 0;  // |w|^2
  // How gamma changes with the parameters of the closest points that are not at the end of their range: none for two
  // points, one for a point and a line, two for a point and a plane, or two lines.
  int parameters = 0;
  std::array<std::array<double, 4>, 2> slope{};
};

namespace detail {

inline void finish(ClosestPoints& c, const std::array<Vec3, 4>& x) {
  c.apart = c.gamma[0] * x[0] + c.gamma[1] * x[1] + c.gamma[2] * x[2] + c.gamma[3] * x[3];
  c.distance2 = dot(c.apart, c.apart);
}

// Point `p` and segment `a`-`b`, each an index into x. sign: +1 where the point is the first primitive.
inline ClosestPoints point_segment(const std::array<Vec3, 4>& x, int p, int a, int b, double sign) {
  const Vec3 along = x[b] - x[a];
  const double length2 = dot(along, along), t = dot(x[p] - x[a], along);
  ClosestPoints c;
  c.gamma[p] = sign;
  if (!(t > 0.0) || !(length2 > 0.0)) {
    c.gamma[a] = -sign;
  } else if (t >= length2) {
    c.gamma[b] = -sign;
  } else {
    const double s = t / length2;
    c.gamma[a] = -sign * (1.0 - s);
    c.gamma[b] = -sign * s;
    c.parameters = 1;
    c.slope[0][a] = sign;
    c.slope[0][b] = -sign;
  }
  finish(c, x);
  return c;
}

inline const ClosestPoints& nearer(const ClosestPoints& a, const ClosestPoints& b) {
  return b.distance2 < a.distance2 ? b : a;
}

}  // namespace detail

// x: the point, then the corners of the triangle.
inline ClosestPoints point_triangle(const std::array<Vec3, 4>& x) {
  const Vec3 e1 = x[2] - x[1], e2 = x[3] - x[1], r = x[0] - x[1];
  const double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), d = dot(e1, r), e = dot(e2, r);
  const double determinant = a * c - b * b;
  if (determinant > 1e-14 * a * c) {
    const double u = (c * d - b * e) / determinant, v = (a * e - b * d) / determinant;
    if (u > 0.0 && v > 0.0 && u + v < 1.0) {
      ClosestPoints inside;
      inside.gamma = {1.0, u + v - 1.0, -u, -v};
      inside.parameters = 2;
      inside.slope = {{{0.0, 1.0, -1.0, 0.0}, {0.0, 1.0, 0.0, -1.0}}};
      detail::finish(inside, x);
      return inside;
    }
  }
  using detail::nearer, detail::point_segment;
  return nearer(nearer(point_segment(x, 0, 1, 2, 1.0), point_segment(x, 0, 2, 3, 1.0)), point_segment(x, 0, 3, 1, 1.0));
}

// x: the ends of the first segment, then those of the second.
inline ClosestPoints segment_segment(const std::array<Vec3, 4>& x) {
  const Vec3 e1 = x[1] - x[0], e2 = x[3] - x[2], r = x[0] - x[2];
  const double a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), d = dot(e1, r), e = dot(e2, r);
  const double determinant = a * c - b * b;
  if (determinant > 1e-14 * a * c) {
    const double s = (b * e - c * d) / determinant, t = (a * e - b * d) / determinant;
    if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) {
      ClosestPoints inside;
      inside.gamma = {1.0 - s, s, t - 1.0, -t};
      inside.parameters = 2;
      inside.slope = {{{-1.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, -1.0}}};
      detail::finish(inside, x);
      return inside;
    }
  }
  using detail::nearer, detail::point_segment;
  return nearer(nearer(point_segment(x, 0, 2, 3, 1.0), point_segment(x, 1, 2, 3, 1.0)),
                nearer(point_segment(x, 2, 0, 1, -1.0), point_segment(x, 3, 0, 1, -1.0)));
}

}  // namespace qlb
