// The distance of a pair as contact sees it: signed in penalty mode, with the unit normal along which it grows.
#pragma once

#include "contact/closest_points.hpp"
#include "contact/contact_set.hpp"

namespace qlb {

struct Separation {
  ClosestPoints closest;
  Vec3 normal;                                                // zero where the distance is zero and has none
  double distance = std::numeric_limits<double>::infinity();  // [m]; infinite: no contact
};

inline Vec3 unit(Vec3 a) {
  const double length = norm(a);
  return length > 0.0 ? (1.0 / length) * a : Vec3{};
}

inline Separation unsigned_separation(ContactKind kind, const std::array<Vec3, 4>& x) {
  Separation s{.closest = kind == ContactKind::vertex_face ? point_triangle(x) : segment_segment(x)};
  s.distance = std::sqrt(s.closest.distance2);
  if (s.distance > 0.0) s.normal = (1.0 / s.distance) * s.closest.apart;
  return s;
}

// Penalty forces push out what is already inside (after Kim, Eberle 2022, "Dynamic Deformables", SIGGRAPH course).
// A vertex: the signed height over the face where it projects inside of it; else the plain distance, and no contact
// behind the face. Two edges: the plain distance times `sign`, -1 once they have passed through each other.
inline Separation signed_separation(ContactKind kind, const std::array<Vec3, 4>& x, double sign) {
  Separation s = unsigned_separation(kind, x);
  if (kind == ContactKind::edge_edge) {
    s.normal = sign * (s.distance > 0.0 ? s.normal : unit(cross(x[1] - x[0], x[3] - x[2])));
    s.distance *= sign;
    return s;
  }
  const Vec3 outward = unit(cross(x[2] - x[1], x[3] - x[1]));
  const double height = dot(outward, s.closest.apart);
  if (s.closest.parameters == 2) {
    s.normal = outward;
    s.distance = height;
  } else if (!(height > 0.0)) {
    s.distance = std::numeric_limits<double>::infinity();
  }
  return s;
}

}  // namespace qlb
