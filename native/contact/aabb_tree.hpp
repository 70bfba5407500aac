// A tree of axis-aligned boxes whose shape is made once and whose boxes follow the motion.
#pragma once

#include <xsimd/xsimd.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "contact/pair_kernels.hpp"
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

// A box rounded outwards to floats, four lanes of which one is idle: compared at once.
struct alignas(16) SmallBox {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  using Lanes = xsimd::make_sized_batch_t<float, 4>;
  float lo[4] = {kInfinity, kInfinity, kInfinity, 0.0f};
  float hi[4] = {-kInfinity, -kInfinity, -kInfinity, 0.0f};

  SmallBox() = default;
  explicit SmallBox(const Box& box)
      : lo{round_down(box.lo.x), round_down(box.lo.y), round_down(box.lo.z), 0.0f},
        hi{round_up(box.hi.x), round_up(box.hi.y), round_up(box.hi.z), 0.0f} {}

  Lanes low() const { return Lanes::load_aligned(lo); }
  Lanes high() const { return Lanes::load_aligned(hi); }
  void add(const SmallBox& b) {
    xsimd::min(low(), b.low()).store_aligned(lo);
    xsimd::max(high(), b.high()).store_aligned(hi);
  }

 private:
  // The nearest float and a little more than one unit in its last place.
  static float round_up(double value) {
    const auto nearest = static_cast<float>(value);
    return nearest + (std::abs(nearest) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min());
  }
  static float round_down(double value) { return -round_up(-value); }
};

inline bool overlap(const SmallBox& a, const SmallBox& b) {
  return xsimd::all((a.low() <= b.high()) & (b.low() <= a.high()));
}

// Nodes lie in depth-first order, so that a query is one loop without a stack: on, or past a subtree it misses. All
// leaves but the last are full: place k is in leaf k / kLeaf.
class AabbTree {
 public:
  struct Node {
    SmallBox box;
    std::int32_t skip = 0;   // the node after this subtree
    std::int32_t leaf = -1;  // its number, -1 inside the tree
  };

  AabbTree() = default;
  // Median splits along the longest side of the boxes of the centres, ties by number.
  explicit AabbTree(std::span<const Vec3> centres);

  // Place k of the tree holds primitive order()[k].
  const std::vector<std::int32_t>& order() const { return order_; }
  std::int32_t leaves() const { return static_cast<std::int32_t>(leaf_nodes_.size()); }
  const LeafBoxes& boxes(std::int32_t leaf) const { return boxes_[leaf]; }
  const SmallBox& around(std::int32_t leaf) const { return nodes_[leaf_nodes_[leaf]].box; }
  const SmallBox& bounds() const { return nodes_.front().box; }
  bool empty() const { return nodes_.empty(); }

  // box_of(place) for every place, then the boxes of all nodes.
  template <class BoxOf>
  void refit(const BoxOf& box_of) {
    for (std::size_t k = 0; k < order_.size(); ++k) {
      const SmallBox box = box_of(k);
      set_box(k, box);
      SmallBox& around = nodes_[leaf_nodes_[k / kLeaf]].box;
      if (k % kLeaf == 0) around = SmallBox{};
      around.add(box);
    }
    refit_nodes();
  }

  // visit(b) for each leaf of `other`, from its leaf `start` on, whose box has a point in common with that of `leaf`.
  template <class Visit>
  void near(std::int32_t leaf, const AabbTree& other, std::int32_t start, const Visit& visit) const {
    const SmallBox box = around(leaf);
    const auto end = static_cast<std::int32_t>(other.nodes_.size());
    for (std::int32_t i = start == 0 ? 0 : other.leaf_nodes_[start]; i < end;) {
      const Node& node = other.nodes_[i];
      const bool hit = overlap(box, node.box);
      if (hit && node.leaf >= 0) visit(node.leaf);
      i = hit ? i + 1 : node.skip;
    }
  }

 private:
  void split(std::span<const Vec3> centres, std::int32_t first, std::int32_t last);
  void refit_nodes();
  void set_box(std::size_t place, const SmallBox& box) {
    LeafBoxes& leaf = boxes_[place / kLeaf];
    for (int d = 0; d < 3; ++d) {
      leaf.lo[d][place % kLeaf] = box.lo[d];
      leaf.hi[d][place % kLeaf] = box.hi[d];
    }
  }

  std::vector<Node> nodes_;
  std::vector<LeafBoxes> boxes_;          // of each leaf
  std::vector<std::int32_t> leaf_nodes_;  // of each leaf, ascending
  std::vector<std::int32_t> order_;
};

}  // namespace qlb
