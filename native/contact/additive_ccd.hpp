// How far two primitives may move along straight paths before they come too near.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "contact/closest_points.hpp"

namespace qlb {

template <int first>
ClosestPoints closest_points(const std::array<Vec3, 4>& x) {
  static_assert(first == 1 || first == 2);
  if constexpr (first == 1) return point_triangle(x);
  return segment_segment(x);
}

namespace detail {

// The time for which the slab normal to n that lies between the primitives stays at least `kept` wide, n a unit vector
// from the second to the first: every n.(x_a - x_b) + t n.(p_a - p_b) >= kept. Infinite if it never gets narrower.
template <int first>
double time_of_slab(const std::array<Vec3, 4>& x, const std::array<Vec3, 4>& p, Vec3 n, double kept) {
  double height[4], speed[4], time = INFINITY;
  for (int i = 0; i < 4; ++i) {
    height[i] = dot(n, x[i]);
    speed[i] = dot(n, p[i]);
  }
  for (int a = 0; a < first; ++a)
    for (int b = first; b < 4; ++b) {
      const double closing = speed[b] - speed[a];
      if (closing <= 0.0) continue;
      const double t = (height[a] - height[b] - kept) / closing;
      if (std::isnan(t)) return 0.0;
      time = std::min(time, t);
    }
  return time;
}

inline bool move_alike(const std::array<Vec3, 4>& p) {
  for (int i = 1; i < 4; ++i)
    if (p[i].x != p[0].x || p[i].y != p[0].y || p[i].z != p[0].z) return false;
  return true;
}

}  // namespace detail

// The largest t in [0, 1] found for which the distance of the primitives, nodes [0, first) and [first, 4), at
// x + t' p is at least slack times that at x for all t' <= t. 0 only if they touch at x and move.
//
// Additive continuous collision detection (Li, Kaufman, Jiang 2021, "Codimensional incremental potential contact",
// algorithm 1): step by a time that is surely free, look at the distance, step again. Their bound of the speed at which
// the distance d shrinks is the largest |p_a| + |p_b|; ours is the speed along the line of the closest points. The
// slab between two planes normal to that line, one through each closest point, separates the convex primitives, so
// that their distance is at least its width for as long as no node enters it. That time is never shorter than theirs,
// and primitives that slide past each other are through in one step. Any t reached is safe, hence the cap.
//
// Stops as soon as t > enough; the value is then only known to be above `enough`.
template <int first>
double additive_ccd(std::array<Vec3, 4> x, const std::array<Vec3, 4>& p, double slack, double enough) {
  constexpr int kSteps = 64;
  constexpr double kResolution = 0.01;  // of the distance at x
  ClosestPoints closest = closest_points<first>(x);
  double distance = std::sqrt(closest.distance2);
  if (!(distance > 0.0)) return detail::move_alike(p) ? 1.0 : 0.0;
  const double kept = slack * distance, near = (slack + kResolution) * distance;
  double t = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    const double free = detail::time_of_slab<first>(x, p, (1.0 / distance) * closest.apart, kept);
    if (t + free >= 1.0) return 1.0;
    if (!(free > 0.0)) break;
    t += free;
    if (t > enough) break;
    for (int i = 0; i < 4; ++i) x[i] = x[i] + free * p[i];
    closest = closest_points<first>(x);
    distance = std::sqrt(closest.distance2);
    if (!(distance > near)) break;
  }
  return t;
}

}  // namespace qlb
