// Tests of many pairs of primitives at once, compiled once for each SIMD level.
#pragma once

#include <cstdint>

namespace qlb {

constexpr int kLeaf = 16;  // primitives in a leaf of a tree, at most

// Boxes of the primitives of a leaf, by axis; lo > hi where there is no primitive.
struct alignas(64) LeafBoxes {
  float lo[3][kLeaf], hi[3][kLeaf];
};

// Their nodes, by corner; -1 where there is none.
struct alignas(64) LeafNodes {
  std::int32_t corner[3][kLeaf];
};

// What the four nodes of kPairs pairs do, by node and axis: anything within a box [a, b], or a straight way from a to
// b. The first primitive has nodes [0, first), the second [first, 4); first = 1: vertex and face, 2: two edges.
constexpr int kPairs = 8;
struct alignas(64) PairMotion {
  double a[4][3][kPairs], b[4][3][kPairs];
};

struct PairKernels {
  // hits[i], bit j: box i of a and box j of b have a common point. `around`: the least box about all of b, lo then hi.
  // Returns the i for which there is one, as bits; only their hits are set.
  unsigned (*overlaps)(const LeafBoxes& a, const LeafBoxes& b, const float around[6], std::uint16_t hits[kLeaf]);
  // Clears the bits of primitives that have a node in common, of the i in `which`; returns those that have bits left.
  // For vertices and faces, edges and edges, edges and faces.
  unsigned (*drop_shared[3])(const LeafNodes& a, const LeafNodes& b, unsigned which, std::uint16_t hits[kLeaf]);
  // Bit k: two planes are found, more than `distance` apart, that have the first primitive of pair k beyond one and
  // the second beyond the other, wherever in their boxes their nodes are.
  unsigned (*apart_in_boxes[2])(const PairMotion& boxes, double distance);  // by first - 1
  // Bit k: two planes are found that are more than `share` of the distance of the primitives of pair k at the start
  // apart, and have one primitive beyond the one and the other beyond the other all along the way.
  unsigned (*apart_on_way[2])(const PairMotion& ways, double share);
};

const PairKernels& pair_kernels_SSE2();
const PairKernels& pair_kernels_AVX2();
const PairKernels& pair_kernels_AVX512();
const PairKernels& pair_kernels_NEON64();

// The best level that runs here.
const PairKernels& pair_kernels();

}  // namespace qlb
