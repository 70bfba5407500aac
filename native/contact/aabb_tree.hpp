// A tree of axis-aligned boxes whose shape is made once and whose boxes follow the motion.
#pragma once

#include <xsimd/xsimd.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
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
  SmallBox grown(double by) const {
    constexpr float kError = 2e-7f;  // above the rounding of a float sum
    const Lanes distance(round_up(by));
    SmallBox box;
    (low() - (distance + kError * (distance + xsimd::abs(low())))).store_aligned(box.lo);
    (high() + (distance + kError * (distance + xsimd::abs(high())))).store_aligned(box.hi);
    return box;
  }

 private:
  static float round_up(double value) {
    const auto nearest = static_cast<float>(value);
    return static_cast<double>(nearest) < value ? std::nextafter(nearest, kInfinity) : nearest;
  }
  static float round_down(double value) { return -round_up(-value); }
};

inline bool overlap(const SmallBox& a, const SmallBox& b) {
  return xsimd::all((a.low() <= b.high()) & (b.low() <= a.high()));
}

// Nodes lie in depth-first order, so that a query is one loop without a stack: on, or past a subtree it misses.
class AabbTree {
 public:
  static constexpr std::int32_t kLeaf = 16;  // primitives in a leaf, at most

  struct Node {
    SmallBox box;
    std::int32_t skip = 0;              // the node after this subtree
    std::int32_t first = 0, count = 0;  // of a leaf: its primitives, as places; count = 0 inside the tree
  };

  AabbTree() = default;
  // Median splits along the longest side of the boxes of the centres, ties by number.
  explicit AabbTree(std::span<const Vec3> centres);

  // Place k of the tree holds primitive order()[k].
  const std::vector<std::int32_t>& order() const { return order_; }
  const std::vector<std::int32_t>& leaves() const { return leaves_; }  // nodes, ascending
  const SmallBox& bounds() const { return nodes_.front().box; }
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
    const SmallBox around = mine.box.grown(distance);
    SmallBox box[kLeaf];
    for (std::int32_t a = 0; a < mine.count; ++a) box[a] = boxes_[mine.first + a].grown(distance);
    const auto end = static_cast<std::int32_t>(other.nodes_.size());
    for (std::int32_t i = start; i < end;) {
      const Node& node = other.nodes_[i];
      if (!overlap(around, node.box)) {
        i = node.skip;
        continue;
      }
      for (std::int32_t a = 0; node.count > 0 && a < mine.count; ++a) {
        if (!overlap(box[a], node.box)) continue;
        // All tests before any visit: branches on each would be mispredicted half the time.
        unsigned hits = 0;
        for (std::int32_t b = 0; b < node.count; ++b)
          hits |= static_cast<unsigned>(overlap(box[a], other.boxes_[node.first + b])) << b;
        for (; hits != 0; hits &= hits - 1) visit(mine.first + a, node.first + std::countr_zero(hits));
      }
      ++i;
    }
  }

 private:
  void split(std::span<const Vec3> centres, std::int32_t first, std::int32_t last);
  void refit_nodes();

  std::vector<Node> nodes_;
  std::vector<SmallBox> boxes_;
  std::vector<std::int32_t> order_, leaves_;
};

}  // namespace qlb
