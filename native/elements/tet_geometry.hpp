// What a deformation is like, without any material.
#pragma once

#include <memory>

#include "elements/kernels.hpp"
#include "elements/tet_blocks.hpp"

namespace qlb {

class TetGeometry {
 public:
  TetGeometry(std::shared_ptr<const TetBlocks> blocks, int threads);

  // The least J = det F over the elements; NaN where one is not a number.
  double least_J(const double* x);
  // How the material at each node has moved between two configurations: (1 - weight) R_i + weight A_i, A_i the matrix
  // with the least sum_e vol_e |A_i F_e(reference) - F_e(x)|^2 over the elements at node i, R_i the rotation nearest to
  // sum_e vol_e F_e(x) F_e(reference)^T; the identity at a node without elements. maps (nodes, 3, 3), row by row.
  // What depends on `reference` alone is kept till another is given.
  void nodal_maps(const double* x, const double* reference, double weight, double* maps);

  std::int64_t nodes() const { return blocks_->nodes; }

 private:
  // sums (nodes, 3, 3) = sum_e vol_e F_e(x) F_e(reference)^T over the elements at each node, 1 without any.
  void correlations(const double* x, const double* reference, double* sums);

  std::shared_ptr<const TetBlocks> blocks_;
  const GeometryKernels* kernels_;
  int threads_;
  Aligned<double> positions_;              // (2, slots, kStride)
  Aligned<double> slot_sums_;              // (slots, 3, 3)
  Aligned<double> reference_;              // (nodes, 3), and its correlations with itself
  Aligned<double> reference_sums_;         // (nodes, 3, 3)
  std::vector<std::int64_t> loose_nodes_;  // those without elements
};

}  // namespace qlb
