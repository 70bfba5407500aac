#include "contact/aabb_tree.hpp"

#include <numeric>
#include <utility>

namespace qlb {
namespace {

double Vec3::* longest_side(const Box& box) {
  const Vec3 side = box.hi - box.lo;
  if (side.x >= side.y && side.x >= side.z) return &Vec3::x;
  return side.y >= side.z ? &Vec3::y : &Vec3::z;
}

}  // namespace

AabbTree::AabbTree(std::span<const Vec3> centres) : order_(centres.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  if (!centres.empty()) split(centres, 0, static_cast<std::int32_t>(centres.size()));
  boxes_.resize(leaf_nodes_.size());
  if (order_.size() % kLeaf != 0)
    for (std::size_t k = order_.size(); k < kLeaf * boxes_.size(); ++k) set_box(k, SmallBox{});
}

void AabbTree::split(std::span<const Vec3> centres, std::int32_t first, std::int32_t last) {
  const std::size_t me = nodes_.size();
  nodes_.emplace_back();
  if (last - first <= kLeaf) {
    std::sort(order_.begin() + first, order_.begin() + last);
    nodes_[me].leaf = leaves();
    leaf_nodes_.push_back(static_cast<std::int32_t>(me));
  } else {
    Box box;
    for (std::int32_t k = first; k < last; ++k) box.add(centres[order_[k]]);
    const auto axis = longest_side(box);
    const std::int32_t leaves = (last - first + kLeaf - 1) / kLeaf;
    const std::int32_t middle = first + leaves / 2 * kLeaf;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](std::int32_t i, std::int32_t j) {
                       return std::pair(centres[i].*axis, i) < std::pair(centres[j].*axis, j);
                     });
    split(centres, first, middle);
    split(centres, middle, last);
  }
  nodes_[me].skip = static_cast<std::int32_t>(nodes_.size());
}

void AabbTree::refit_nodes() {
  for (auto i = static_cast<std::int32_t>(nodes_.size()) - 1; i >= 0; --i) {  // children come after their parent
    Node& node = nodes_[i];
    if (node.leaf >= 0) continue;
    const Node& left = nodes_[i + 1];
    node.box = left.box;
    node.box.add(nodes_[left.skip].box);
  }
}

}  // namespace qlb
