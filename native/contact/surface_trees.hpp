// Trees over the vertices, edges and faces of each group of a surface, and searches through pairs of them.
#pragma once

#include <array>
#include <bit>
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
  std::vector<LeafNodes> leaf_slots;                   // those of each leaf

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

// Runs find(begin, end, found) for parts of [0, count) in parallel; `found` of all are appended to `out` in order.
class OrderedCollector {
 public:
  explicit OrderedCollector(int threads) : threads_(threads), parts_(8 * threads) {}

  template <class Find>
  void collect(std::int64_t count, std::vector<Pair>& out, const Find& find) {
    if (threads_ == 1) {
      find(0, count, out);
      return;
    }
    const auto parts = static_cast<std::int64_t>(parts_.size());
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_)
    for (std::int64_t part = 0; part < parts; ++part) {
      parts_[part].clear();
      find(part * count / parts, (part + 1) * count / parts, parts_[part]);
    }
    for (const auto& part : parts_) out.insert(out.end(), part.begin(), part.end());
  }

 private:
  int threads_;
  std::vector<std::vector<Pair>> parts_;
};

// Appends the places of all pairs, one of leaf `leaf` of a, one of b, that share no node and whose boxes meet. Where a
// is b, only pairs (i, j) with i < j.
template <std::size_t A, std::size_t B>
void find_near(const TreePair<A, B>& trees, std::int32_t leaf, std::vector<Pair>& places) {
  const PrimitiveTree<A>* a = trees.a;
  const PrimitiveTree<B>* b = trees.b;
  const bool same = static_cast<const void*>(a) == static_cast<const void*>(b);
  constexpr int kKinds = static_cast<int>(A + B == 4 ? A - 1 : 2);
  const PairKernels& kernels = pair_kernels();
  a->tree.near(leaf, b->tree, same ? leaf : 0, [&](std::int32_t other) {
    const SmallBox& box = b->tree.around(other);
    const float around[6] = {box.lo[0], box.lo[1], box.lo[2], box.hi[0], box.hi[1], box.hi[2]};
    alignas(64) std::uint16_t hits[kLeaf];
    unsigned which = kernels.overlaps(a->tree.boxes(leaf), b->tree.boxes(other), around, hits);
    which = kernels.drop_shared[kKinds](a->leaf_slots[leaf], b->leaf_slots[other], which, hits);
    for (; which != 0; which &= which - 1) {
      const std::int32_t i = std::countr_zero(which);
      unsigned found = hits[i];
      if (same && leaf == other) found &= ~0u << i;
      for (; found != 0; found &= found - 1)
        places.push_back({kLeaf * leaf + i, kLeaf * other + std::countr_zero(found)});
    }
  });
}

// Appends to `out` the ids (of a, of b) of all pairs that share no node, whose boxes meet and that are left by
// keep(trees, places), which takes pairs of places out of a list. Always in the same order.
template <std::size_t A, std::size_t B, class Keep>
void search(const std::vector<TreePair<A, B>>& trees, OrderedCollector& collector, std::vector<Pair>& out,
            const Keep& keep) {
  struct Query {
    const TreePair<A, B>* trees;
    std::int32_t leaf;
  };
  std::vector<Query> queries;
  for (const auto& pair : trees)
    if (!pair.a->tree.empty() && !pair.b->tree.empty() && overlap(pair.a->tree.bounds(), pair.b->tree.bounds()))
      for (std::int32_t leaf = 0; leaf < pair.a->tree.leaves(); ++leaf) queries.push_back({&pair, leaf});
  const auto count = static_cast<std::int64_t>(queries.size());
  collector.collect(count, out, [&](std::int64_t begin, std::int64_t end, std::vector<Pair>& found) {
    constexpr std::size_t kEnough = 1024;  // for keep to work on
    std::vector<Pair> places;
    for (std::int64_t k = begin; k < end; ++k) {
      const auto& pair = *queries[k].trees;
      find_near(pair, queries[k].leaf, places);
      if (places.size() < kEnough && k + 1 < end && queries[k + 1].trees == &pair) continue;
      keep(pair, places);
      for (const auto& [i, j] : places) found.push_back({pair.a->ids[i], pair.b->ids[j]});
      places.clear();
    }
  });
}

}  // namespace qlb
