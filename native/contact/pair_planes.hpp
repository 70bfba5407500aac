// Planes that keep two primitives apart, for as many pairs as the vector type V has lanes.
//
// Any direction may be tried: a bad one only finds no planes. First that of the line of the middles, which is quick,
// then that of the line of the closest points (Ericson 2005, "Real-time collision detection", section 5.1, without
// branches; primitives of no area or length give some direction, or one that is not a number and finds nothing).
#pragma once

#include "contact/pair_kernels.hpp"
#include "simd/lane_bits.hpp"

namespace qlb::planes {

template <class V>
struct Point {
  V x, y, z;

  friend Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Point operator*(const V& s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
  friend V dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

template <class V>
Point<V> load(const double from[3][kPairs], int lane) {
  return {V::load_aligned(from[0] + lane), V::load_aligned(from[1] + lane), V::load_aligned(from[2] + lane)};
}

template <class V>
V clamp(const V& value) {
  return xsimd::min(xsimd::max(value, V(0.0)), V(1.0));
}

template <class V>
Point<V> select(const xsimd::batch_bool<double, typename V::arch_type>& which, const Point<V>& a, const Point<V>& b) {
  return {xsimd::select(which, a.x, b.x), xsimd::select(which, a.y, b.y), xsimd::select(which, a.z, b.z)};
}

template <class V, int first>
Point<V> between_middles(const Point<V> (&x)[4]) {
  if constexpr (first == 1) return x[0] - V(1.0 / 3.0) * (x[1] + x[2] + x[3]);
  return V(0.5) * (x[0] + x[1] - x[2] - x[3]);
}

// From the segment a, a + edge to the point a + r.
template <class V>
Point<V> from_segment(const Point<V>& edge, const Point<V>& r) {
  return r - clamp(dot(r, edge) / dot(edge, edge)) * edge;
}

template <class V>
Point<V> nearer(const Point<V>& a, const Point<V>& b) {
  return select<V>(dot(b, b) < dot(a, a), b, a);
}

template <class V, int first>
Point<V> between_closest(const Point<V> (&x)[4]) {
  if constexpr (first == 1) {
    const Point<V> e1 = x[2] - x[1], e2 = x[3] - x[1], r = x[0] - x[1];
    const V a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), d = dot(e1, r), e = dot(e2, r);
    const V scale = V(1.0) / (a * c - b * b), u = (c * d - b * e) * scale, v = (a * e - b * d) * scale;
    const Point<V> rim =
        nearer(nearer(from_segment(e1, r), from_segment(e2, r)), from_segment(x[3] - x[2], x[0] - x[2]));
    return select<V>((u > V(0.0)) & (v > V(0.0)) & (u + v < V(1.0)), r - u * e1 - v * e2, rim);
  } else {
    const Point<V> e1 = x[1] - x[0], e2 = x[3] - x[2], r = x[0] - x[2];
    const V a = dot(e1, e1), b = dot(e1, e2), c = dot(e2, e2), d = dot(e1, r), e = dot(e2, r);
    const V s = clamp((b * e - c * d) / (a * c - b * b));
    const V t = clamp((b * s + e) / c);
    return r + clamp((b * t - d) / a) * e1 - t * e2;
  }
}

// The width of the widest slab normal to n that lies between the primitives, times |n|; negative if there is none.
template <class V, int first, class Range>
V width(const Point<V>& n, const Range& range) {
  V low = range.lowest(0, n), high = range.highest(first, n);
  for (int i = 1; i < first; ++i) low = xsimd::min(low, range.lowest(i, n));
  for (int i = first + 1; i < 4; ++i) high = xsimd::max(high, range.highest(i, n));
  return low - high;
}

template <class V>
struct Boxes {
  Point<V> centre[4], half[4];

  V reach(int i, const Point<V>& n) const {
    return xsimd::abs(n.x) * half[i].x + xsimd::abs(n.y) * half[i].y + xsimd::abs(n.z) * half[i].z;
  }
  V lowest(int i, const Point<V>& n) const { return dot(n, centre[i]) - reach(i, n); }
  V highest(int i, const Point<V>& n) const { return dot(n, centre[i]) + reach(i, n); }
};

template <class V>
struct Ways {
  Point<V> start[4], end[4];

  V lowest(int i, const Point<V>& n) const { return xsimd::min(dot(n, start[i]), dot(n, end[i])); }
  V highest(int i, const Point<V>& n) const { return xsimd::max(dot(n, start[i]), dot(n, end[i])); }
};

// test(n) -> lanes: of the line of the middles, and where that does not do, of the closest points.
template <class V, int first, class Test>
unsigned lanes_apart(const Point<V> (&x)[4], const Test& test) {
  const auto found = test(between_middles<V, first>(x));
  if (xsimd::all(found)) return lane_bits(found);
  return lane_bits(found | test(between_closest<V, first>(x)));
}

template <class V, int first>
unsigned apart_in_boxes(const PairMotion& motion, double distance) {
  unsigned found = 0;
  for (int lane = 0; lane < kPairs; lane += static_cast<int>(V::size)) {
    Boxes<V> boxes;
    for (int i = 0; i < 4; ++i) {
      const Point<V> lo = load<V>(motion.a[i], lane), hi = load<V>(motion.b[i], lane);
      boxes.centre[i] = V(0.5) * (lo + hi);
      boxes.half[i] = V(0.5) * (hi - lo);
    }
    const auto test = [&](const Point<V>& n) {
      return width<V, first>(n, boxes) > V(distance) * xsimd::sqrt(dot(n, n));
    };
    found |= lanes_apart<V, first>(boxes.centre, test) << lane;
  }
  return found;
}

template <class V, int first>
unsigned apart_on_way(const PairMotion& motion, double share) {
  unsigned found = 0;
  for (int lane = 0; lane < kPairs; lane += static_cast<int>(V::size)) {
    Ways<V> ways;
    for (int i = 0; i < 4; ++i) {
      ways.start[i] = load<V>(motion.a[i], lane);
      ways.end[i] = load<V>(motion.b[i], lane);
    }
    // n joins a point of each primitive: |n| is at least their distance.
    const auto test = [&](const Point<V>& n) { return width<V, first>(n, ways) > V(share) * dot(n, n); };
    found |= lanes_apart<V, first>(ways.start, test) << lane;
  }
  return found;
}

}  // namespace qlb::planes
