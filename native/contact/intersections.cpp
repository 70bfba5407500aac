#include "contact/intersections.hpp"

#include <algorithm>

#include "contact/candidates.hpp"
#include "contact/orientation.hpp"

namespace qlb {
namespace {

double coordinate(Vec3 v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

bool ranges_overlap(int axis, Vec3 p, Vec3 q, Vec3 a, Vec3 b) {
  const auto [p0, p1] = std::minmax({coordinate(p, axis), coordinate(q, axis)});
  const auto [a0, a1] = std::minmax({coordinate(a, axis), coordinate(b, axis)});
  return p0 <= a1 && a0 <= p1;
}

bool segments_meet_in_plane(int axis, Vec3 p, Vec3 q, Vec3 a, Vec3 b) {
  if (!ranges_overlap((axis + 1) % 3, p, q, a, b) || !ranges_overlap((axis + 2) % 3, p, q, a, b)) return false;
  return orientation_in_plane(axis, p, q, a) * orientation_in_plane(axis, p, q, b) <= 0 &&
         orientation_in_plane(axis, a, b, p) * orientation_in_plane(axis, a, b, q) <= 0;
}

// Segments meet if they lie in one plane and meet in each plane of coordinates: one of these shows theirs undistorted.
bool segments_meet(Vec3 p, Vec3 q, Vec3 a, Vec3 b) {
  return segments_meet_in_plane(0, p, q, a, b) && segments_meet_in_plane(1, p, q, a, b) &&
         segments_meet_in_plane(2, p, q, a, b) && orientation(p, q, a, b) == 0;
}

// p in the plane of a triangle; false for a degenerate one.
bool inside(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  for (int axis = 0; axis < 3; ++axis) {
    const int side = orientation_in_plane(axis, a, b, c);
    if (side == 0) continue;  // seen from the edge
    return side * orientation_in_plane(axis, a, b, p) >= 0 && side * orientation_in_plane(axis, b, c, p) >= 0 &&
           side * orientation_in_plane(axis, c, a, p) >= 0;
  }
  return false;
}

}  // namespace

bool segment_meets_triangle(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const int side_p = orientation(a, b, c, p), side_q = orientation(a, b, c, q);
  if (side_p * side_q > 0) return false;
  if (side_p != 0 || side_q != 0) {  // the line crosses the plane in one point: on no two different sides of edges
    const int ab = orientation(p, q, a, b), bc = orientation(p, q, b, c), ca = orientation(p, q, c, a);
    return std::max({ab, bc, ca}) - std::min({ab, bc, ca}) < 2;
  }
  return inside(p, a, b, c) || inside(q, a, b, c) || segments_meet(p, q, a, b) || segments_meet(p, q, b, c) ||
         segments_meet(p, q, c, a);
}

std::vector<Pair> Candidates::intersections(const double* x) {
  check_finite(x, "x");
  const auto at = [&](std::int32_t slot) { return load3(x + 3 * static_cast<std::int64_t>(trees_.nodes[slot])); };
  std::vector<SmallBox> boxes;
  for (std::size_t slot = 0; slot < trees_.nodes.size(); ++slot) {
    const Vec3 place = at(static_cast<std::int32_t>(slot));
    boxes.emplace_back(Box{place, place});
  }
  std::vector<TreePair<2, 3>> trees;
  const auto count = static_cast<std::int32_t>(trees_.groups.size());
  for (GroupTrees& group : trees_.groups) group.refit(boxes);
  for (std::int32_t g = 0; g < count; ++g)
    for (std::int32_t h = 0; h < count; ++h)
      if (surface_->allowed(g, h)) trees.push_back({&trees_.groups[g].edges, &trees_.groups[h].faces});
  std::vector<Pair> found;
  search(trees, collector_, found, [&](const auto& pair, std::vector<Pair>& places) {
    std::erase_if(places, [&](const Pair& place) {
      const auto& edge = pair.a->slots[place[0]];
      const auto& face = pair.b->slots[place[1]];
      return !segment_meets_triangle(at(edge[0]), at(edge[1]), at(face[0]), at(face[1]), at(face[2]));
    });
  });
  return found;
}

}  // namespace qlb
