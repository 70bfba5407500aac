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

// The time for which the slab normal to the unit vector n that lies between the primitives, the first on the side n
// points to, is at least `kept` wide: every n.(x_a - x_b) + t n.(p_a - p_b) >= kept. Infinite if it never gets
// narrower, 0 if it is too narrow or there is none.
template <int first>
double time_of_slab(const std::array<Vec3, 4>& x, const std::array<Vec3, 4>& p, Vec3 n, double kept) {
  double height[4], speed[4], time = INFINITY;
  for (int i = 0; i < 4; ++i) {
    height[i] = dot(n, x[i]);
    speed[i] = dot(n, p[i]);
  }
  for (int a = 0; a < first; ++a)
    for (int b = first; b < 4; ++b) {
      const double spare = height[a] - height[b] - kept, closing = speed[b] - speed[a];
      if (!(spare > 0.0) || std::isnan(closing)) return 0.0;
      if (closing > 0.0) time = std::min(time, spare / closing);
    }
  return time;
}

// Along the line of the closest points. w is rounded by a part of the size of the primitives, which may be as large as
// w; what of it lies along the edge that it must be normal to is taken off.
inline Vec3 closest_direction(const ClosestPoints& closest, const std::array<Vec3, 4>& x) {
  Vec3 w = closest.apart;
  if (closest.parameters == 1) {
    Vec3 edge;
    for (int i = 0; i < 4; ++i) edge = edge + closest.slope[0][i] * x[i];
    w = w - (dot(w, edge) / dot(edge, edge)) * edge;
  }
  return (1.0 / norm(w)) * w;
}

// Normal to the face or to both edges, without the rounding of w; not a number where there is none.
template <int first>
Vec3 common_normal(const ClosestPoints& closest, const std::array<Vec3, 4>& x) {
  const Vec3 normal = first == 1 ? cross(x[2] - x[1], x[3] - x[1]) : cross(x[1] - x[0], x[3] - x[2]);
  return (std::copysign(1.0, dot(normal, closest.apart)) / norm(normal)) * normal;
}

template <int first>
double free_time(const ClosestPoints& closest, const std::array<Vec3, 4>& x, const std::array<Vec3, 4>& p,
                 double kept) {
  const double time = time_of_slab<first>(x, p, closest_direction(closest, x), kept);
  return time >= 1.0 ? time : std::max(time, time_of_slab<first>(x, p, common_normal<first>(closest, x), kept));
}

inline bool move_alike(const std::array<Vec3, 4>& p) {
  for (int i = 1; i < 4; ++i)
    if (p[i].x != p[0].x || p[i].y != p[0].y || p[i].z != p[0].z) return false;
  return true;
}

}  // namespace detail

// The largest t in [0, 1] found for which the distance of the primitives, nodes [0, first) and [first, 4), at
// x + t' p is at least slack times that at x for all t' <= t. 0 only if they touch at x, to rounding, and move.
//
// Additive continuous collision detection (Li, Kaufman, Jiang 2021, "Codimensional incremental potential contact",
// algorithm 1): step by a time that is surely free, look at the distance, step again; any t reached is safe, hence the
// cap. Theirs is the time in which the distance d shrinks at its greatest speed, max |p_a| + max |p_b|. Ours is the
// time for which a slab lies between the primitives: they are convex, so that they are at least its width apart until
// a node enters it. The slab normal to the line of the closest points is d wide, and nodes enter it no faster than
// that. So the time is never shorter, and primitives that slide past each other are through in one step.
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
    const double free = detail::free_time<first>(closest, x, p, kept);
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
