// The pairs of primitives that may come near each other, kept while the surface stays where it was said to stay.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "contact/surface.hpp"
#include "contact/surface_trees.hpp"

namespace qlb {

// Two groups are searched in absolute positions. Within a group positions are taken relative to the mean vertex of
// the group's surface, so that a body that flies as a whole does not sweep through itself.
class Candidates {
 public:
  Candidates(std::shared_ptr<const ContactSurface> surface, int threads);

  // Lists all pairs, vertex with face and edge with edge, that share no node, whose groups may touch and that may come
  // within `radius` of each other while each vertex stays in its box: the hull of x_i and x_i + p_i, `margin` larger
  // on all sides. Some pairs more may be listed. x, p: (nodes, 3).
  void build(const double* x, const double* p, double margin, double radius);

  // Whether all vertices stay in their boxes on the straight way from x to x + p, so that the lists are complete.
  bool covers(const double* x, const double* p) const;

  const std::vector<Pair>& vertex_faces() const { return vertex_faces_; }  // node, face
  const std::vector<Pair>& edge_edges() const { return edge_edges_; }      // edges, the lower number first

  // The largest step in [0, 1] such that each listed pair keeps at least `slack` of its distance at x all along
  // x + step p. 0 only where a pair touches at x.
  double step_bound(const double* x, const double* p);
  // The pair that bounded the last step below 1: the nodes of its first primitive, then of its second.
  bool limited() const { return limited_; }
  const std::array<std::int32_t, 4>& limiting() const { return limiting_; }

  // Least distance of the listed pairs at x; infinite if there are none.
  double minimum_distance(const double* x) const;

  // Nodes of the listed pairs that are nearer than `radius` at x, of the first primitive, then of the second.
  std::vector<std::array<std::int32_t, 4>> near(const double* x, double radius) const;

  // Edges that pass through or touch faces at x, of groups that may touch, without a common node: edge, face. Needs
  // and changes no list.
  std::vector<Pair> intersections(const double* x);

  double slack() const { return slack_; }
  void set_slack(double slack);
  const ContactSurface& surface() const { return *surface_; }

 private:
  struct Frame {  // of a group: what its positions are relative to, at both ends of a path
    Vec3 start, end;
  };
  Frame mean_frame(const GroupTrees& group, const double* x, const double* p) const;
  Box path(std::int32_t slot, const Frame& frame, const double* x, const double* p) const;
  void find_pairs(const std::vector<Box>& boxes, bool within_groups, double radius);
  void check_finite(const double* values, const char* name) const;
  std::array<std::int32_t, 4> pair_nodes(std::int64_t pair) const;
  double squared_distance(const double* x, std::int64_t pair) const;
  // Of pairs [begin, end), up to kPairs of one kind: a bit for each for which no planes were found that stay between
  // its primitives, the slack apart, all along x -> x + p.
  unsigned pairs_in_the_way(const double* x, const double* p, std::int64_t begin, std::int64_t end) const;
  std::int64_t vertex_face_count() const { return static_cast<std::int64_t>(vertex_faces_.size()); }
  std::int64_t pairs() const { return static_cast<std::int64_t>(vertex_faces_.size() + edge_edges_.size()); }

  std::shared_ptr<const ContactSurface> surface_;
  int threads_;
  double slack_ = 0.1;
  SurfaceTrees trees_;
  OrderedCollector collector_;
  bool built_ = false;
  std::vector<Box> absolute_, relative_;  // of each slot
  std::vector<Pair> vertex_faces_, edge_edges_;
  bool limited_ = false;
  std::array<std::int32_t, 4> limiting_{};
};

}  // namespace qlb
