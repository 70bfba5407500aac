#include "contact/surface_trees.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace qlb {
namespace {

// The tree over `members`, the numbers of some primitives; corners: the nodes of all primitives.
template <std::size_t width, class Corners>
PrimitiveTree<width> build_tree(const std::vector<std::int32_t>& members, const Corners& corners, const double* rest) {
  std::vector<Vec3> centres;
  for (const std::int32_t id : members) {
    Vec3 sum;
    for (const std::int32_t node : corners(id)) sum = sum + load3(rest + 3 * static_cast<std::int64_t>(node));
    centres.push_back((1.0 / static_cast<double>(width)) * sum);
  }
  PrimitiveTree<width> tree;
  tree.tree = AabbTree(centres);
  for (const std::int32_t k : tree.tree.order()) {
    tree.ids.push_back(members[k]);
    tree.slots.push_back(corners(members[k]));
  }
  return tree;
}

template <std::size_t width>
void number_by_slot(PrimitiveTree<width>& tree, const std::vector<std::int32_t>& slot_of_node) {
  for (auto& corners : tree.slots)
    for (std::int32_t& node : corners) node = slot_of_node[node];
  LeafNodes none;
  for (auto& corner : none.corner) std::ranges::fill(corner, -1);
  tree.leaf_slots.assign(tree.tree.leaves(), none);
  for (std::size_t place = 0; place < tree.slots.size(); ++place)
    for (std::size_t k = 0; k < width; ++k)
      tree.leaf_slots[place / kLeaf].corner[k][place % kLeaf] = tree.slots[place][k];
}

template <std::size_t width>
std::vector<std::vector<std::int32_t>> members_by_group(
    const ContactSurface& surface, const std::vector<std::array<std::int32_t, width>>& primitives) {
  std::vector<std::vector<std::int32_t>> members(surface.groups());
  for (std::size_t id = 0; id < primitives.size(); ++id) {
    const std::int32_t group = surface.group(primitives[id][0]);
    for (const std::int32_t node : primitives[id])
      if (surface.group(node) != group)
        throw std::invalid_argument("a face joins node " + std::to_string(primitives[id][0]) + " of group " +
                                    std::to_string(group) + " and node " + std::to_string(node) + " of group " +
                                    std::to_string(surface.group(node)));
    members[group].push_back(static_cast<std::int32_t>(id));
  }
  return members;
}

}  // namespace

SurfaceTrees::SurfaceTrees(const ContactSurface& surface) : groups(surface.groups()) {
  const auto faces = members_by_group(surface, surface.faces());
  const auto edges = members_by_group(surface, surface.edges());
  std::vector<std::vector<std::int32_t>> vertices(surface.groups());
  for (const std::int32_t node : surface.vertices()) vertices[surface.group(node)].push_back(node);

  std::vector<std::int32_t> slot_of_node(surface.nodes(), -1);
  for (std::int32_t g = 0; g < surface.groups(); ++g) {
    GroupTrees& group = groups[g];
    const double* rest = surface.rest();
    group.vertices = build_tree<1>(vertices[g], [](std::int32_t node) { return std::array{node}; }, rest);
    group.edges = build_tree<2>(edges[g], [&](std::int32_t e) { return surface.edges()[e]; }, rest);
    group.faces = build_tree<3>(faces[g], [&](std::int32_t f) { return surface.faces()[f]; }, rest);
    group.first = static_cast<std::int32_t>(nodes.size());
    for (const std::int32_t node : group.vertices.ids) {
      slot_of_node[node] = static_cast<std::int32_t>(nodes.size());
      nodes.push_back(node);
    }
    group.last = static_cast<std::int32_t>(nodes.size());
    number_by_slot(group.vertices, slot_of_node);
    number_by_slot(group.edges, slot_of_node);
    number_by_slot(group.faces, slot_of_node);
    group.meets_itself = surface.allowed(g, g);
    for (std::int32_t h = 0; h < surface.groups(); ++h)
      group.meets_others |= h != g && !vertices[h].empty() && surface.allowed(g, h);
  }
}

}  // namespace qlb
