// The triangles that may touch: faces, edges and vertices of all bodies and obstacles, and who may touch whom.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace qlb {

// Nodes are those of the whole system. A group is one body or one obstacle.
class ContactSurface {
 public:
  // rest: (nodes, 3); faces: (f, 3); group of each node; allowed: (groups, groups), symmetric, nonzero where two
  // groups may touch (on the diagonal: a group itself).
  ContactSurface(std::span<const double> rest, std::span<const std::int32_t> faces, std::span<const std::int32_t> group,
                 std::span<const std::uint8_t> allowed);

  std::int64_t nodes() const { return static_cast<std::int64_t>(group_.size()); }
  std::int32_t groups() const { return groups_; }
  std::int32_t group(std::int32_t node) const { return group_[node]; }
  const double* rest() const { return rest_.data(); }  // (nodes, 3)
  bool allowed(std::int32_t group_a, std::int32_t group_b) const { return allowed_[group_a * groups_ + group_b]; }

  const std::vector<std::array<std::int32_t, 3>>& faces() const { return faces_; }
  const std::vector<std::array<std::int32_t, 2>>& edges() const { return edges_; }  // low node first, ascending
  const std::vector<std::int32_t>& vertices() const { return vertices_; }           // nodes of faces, ascending
  // At rest: a third of the area of the faces at a node (0 inside a body) or at an edge; squared lengths of edges.
  double node_area(std::int32_t node) const { return node_area_[node]; }
  double edge_area(std::int32_t edge) const { return edge_area_[edge]; }
  double edge_length2(std::int32_t edge) const { return edge_length2_[edge]; }

 private:
  std::int32_t groups_;
  std::vector<std::int32_t> group_;
  std::vector<double> rest_;
  std::vector<std::uint8_t> allowed_;
  std::vector<std::array<std::int32_t, 3>> faces_;
  std::vector<std::array<std::int32_t, 2>> edges_;
  std::vector<std::int32_t> vertices_;
  std::vector<double> node_area_, edge_area_, edge_length2_;
};

}  // namespace qlb
