// Trees over the vertices, edges and faces of each group of a surface, and searches through pairs of them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "contact/aabb_tree.hpp"
#include "contact/surface.hpp"

namespace qlb {

// Vertices of the surface are numbered by `slot`: group after group, in the order of the group's tree of vertices.
template <std::size_t width>
struct PrimitiveTree {
  AabbTree tree;
  std::vector<std::array<std::int32_t, width>> slots;  // of the primitive at each place of the tree
  std::vector<std::int32_t> ids;                       // node, edge or face at each place

  // boxes: of each slot
  void refit(const std::vector<SmallBox>& boxes) {
    tree.refit([&](std::size_t place) {
      SmallBox box = boxes[slots[place][0]];
      for (std::size_t k = 1; k < width; ++k) box.add(boxes[slots[place][k]]);
      return box;
    });
  }
};

struct GroupTrees {
  PrimitiveTree<1> vertices;
  PrimitiveTree<2> edges;
  PrimitiveTree<3> faces;
  std::int32_t first = 0, last = 0;  // slots [first, last)
  bool meets_itself = false, meets_others = false;

  void refit(const std::vector<SmallBox>& boxes) {
    vertices.refit(boxes);
    edges.refit(boxes);
    faces.refit(boxes);
  }
};

struct SurfaceTrees {
  explicit SurfaceTrees(const ContactSurface& surface);

  std::vector<GroupTrees> groups;
  std::vector<std::int32_t> nodes;  // of each slot
};

// All primitives of one tree against all of another, or against each other where both are the same.
template <std::size_t A, std::size_t B>
struct TreePair {
  const PrimitiveTree<A>* a;
  const PrimitiveTree<B>* b;
};

using Pair = std::array<std::int32_t, 2>;

// Runs find(k, found) for k < count in parallel; `found` of all are appended to `out` in the order of k.
class OrderedCollector {
 public:
  explicit OrderedCollector(int threads) : threads_(threads), parts_(8 * threads) {}

  template <class Find>
  void collect(std::int64_t count, std::vector<Pair>& out, const Find& find) {
    if (threads_ == 1) {
      for (std::int64_t k = 0; k < count; ++k) find(k, out);
      return;
    }
    const auto parts = static_cast<std::int64_t>(parts_.size());
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_)
    for (std::int64_t part = 0; part < parts; ++part) {
      parts_[part].clear();
      for (std::int64_t k = part * count / parts; k < (part + 1) * count / parts; ++k) find(k, parts_[part]);
    }
    for (const auto& part : parts_) out.insert(out.end(), part.begin(), part.end());
  }

 private:
  int threads_;
  std::vector<std::vector<Pair>> parts_;
};

template <std::size_t A, std::size_t B>
bool share_a_node(const std::array<std::int32_t, A>& a, const std::array<std::int32_t, B>& b) {
  bool shared = false;
  for (const std::int32_t i : a)
    for (const std::int32_t j : b) shared |= i == j;
  return shared;
}

// Appends to `out` the ids (of a, of b) of all pairs that share no node, whose boxes are within `distance` (infinity
// norm) and for which accept(slots of a, slots of b). Always in the same order.
template <std::size_t A, std::size_t B, class Accept>
void search(const std::vector<TreePair<A, B>>& trees, double distance, OrderedCollector& collector,
            std::vector<Pair>& out, const Accept& accept) {
  struct Query {
    const TreePair<A, B>* trees;
    std::int32_t leaf;
  };
  std::vector<Query> queries;
  for (const auto& pair : trees)
    if (!pair.a->tree.empty() && !pair.b->tree.empty() &&
        overlap(pair.a->tree.bounds().grown(distance), pair.b->tree.bounds()))
      for (const std::int32_t leaf : pair.a->tree.leaves()) queries.push_back({&pair, leaf});
  collector.collect(static_cast<std::int64_t>(queries.size()), out, [&](std::int64_t k, std::vector<Pair>& found) {
    const auto& [a, b] = *queries[k].trees;
    const bool same = static_cast<const void*>(a) == static_cast<const void*>(b);
    a->tree.near(queries[k].leaf, b->tree, same ? queries[k].leaf : 0, distance, [&](std::int32_t i, std::int32_t j) {
      if (same && j <= i) return;  // each pair once: later places only
      if (!share_a_node(a->slots[i], b->slots[j]) && accept(a->slots[i], b->slots[j]))
        found.push_back({a->ids[i], b->ids[j]});
    });
  });
}

}  // namespace qlb
