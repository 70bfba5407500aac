// A tree of axis-aligned boxes whose shape is made once and whose boxes follow the motion.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "contact/vec3.hpp"

namespace qlb {

struct Box {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 lo{kInfinity, kInfinity, kInfinity}, hi{-kInfinity, -kInfinity, -kInfinity};

  void add(const Box& b) {
    lo = {std::min(lo.x, b.lo.x), std::min(lo.y, b.lo.y), std::min(lo.z, b.lo.z)};
    hi = {std::max(hi.x, b.hi.x), std::max(hi.y, b.hi.y), std::max(hi.z, b.hi.z)};
  }
  void add(Vec3 point) { add(Box{point, point}); }
  Box grown(double by) const { return {lo - Vec3{by, by, by}, hi + Vec3{by, by, by}}; }
  // False for a point that is not a number.
  bool contains(Vec3 p) const {
    return lo.x <= p.x && p.x <= hi.x && lo.y <= p.y && p.y <= hi.y && lo.z <= p.z && p.z <= hi.z;
  }
};

inline bool overlap(const Box& a, const Box& b) {
  return a.lo.x <= b.hi.x && b.lo.x <= a.hi.x && a.lo.y <= b.hi.y && b.lo.y <= a.hi.y && a.lo.z <= b.hi.z &&
         b.lo.z <= a.hi.z;
}

// Nodes lie in depth-first order, so that a query is one loop without a stack: on, or past a subtree it misses.
class AabbTree {
 public:
  struct Node {
    Box box;
    std::int32_t skip = 0;              // the node after this subtree
    std::int32_t first = 0, count = 0;  // of a leaf: its primitives, as places; count = 0 inside the tree
  };

  AabbTree() = default;
  // Median splits along the longest side of the boxes of the centres, ties by number.
  explicit AabbTree(std::span<const Vec3> centres);

  // Place k of the tree holds primitive order()[k].
  const std::vector<std::int32_t>& order() const { return order_; }
  const std::vector<std::int32_t>& leaves() const { return leaves_; }  // nodes, ascending
  const Box& bounds() const { return nodes_.front().box; }
  bool empty() const { return nodes_.empty(); }

  // box_of(place) for every place, then the boxes of all nodes.
  template <class BoxOf>
  void refit(const BoxOf& box_of) {
    for (std::size_t k = 0; k < order_.size(); ++k) boxes_[k] = box_of(k);
    refit_nodes();
  }

  // visit(a, b) for each place a of the leaf `leaf` of this tree and each place b of `other`, at its node `start` or
  // later, whose boxes are within `distance` of each other (infinity norm).
  template <class Visit>
  void near(std::int32_t leaf, const AabbTree& other, std::int32_t start, double distance, const Visit& visit) const {
    const Node& mine = nodes_[leaf];
    const Box around = mine.box.grown(distance);
    const auto end = static_cast<std::int32_t>(other.nodes_.size());
    for (std::int32_t i = start; i < end;) {
      const Node& node = other.nodes_[i];
      if (!overlap(around, node.box)) {
        i = node.skip;
        continue;
      }
      for (std::int32_t a = mine.first; node.count > 0 && a < mine.first + mine.count; ++a) {
        const Box box = boxes_[a].grown(distance);
        if (!overlap(box, node.box)) continue;
        for (std::int32_t b = node.first; b < node.first + node.count; ++b)
          if (overlap(box, other.boxes_[b])) visit(a, b);
      }
      ++i;
    }
  }

 private:
  void split(std::span<const Vec3> centres, std::int32_t first, std::int32_t last);
  void refit_nodes();

  std::vector<Node> nodes_;
  std::vector<Box> boxes_;
  std::vector<std::int32_t> order_, leaves_;
};

}  // namespace qlb
