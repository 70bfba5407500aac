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
  // The rotation of the material at each node between two configurations: R_i is the polar factor of
  // sum_e vol_e F_e(x) F_e(reference)^T over the elements at node i. rotations (nodes, 3, 3), row by row.
  void rotations(const double* x, const double* reference, double* rotations);

  std::int64_t nodes() const { return blocks_->nodes; }

 private:
  std::shared_ptr<const TetBlocks> blocks_;
  const GeometryKernels* kernels_;
  int threads_;
  Aligned<double> positions_;  // (2, slots, kStride)
  Aligned<double> slot_sums_;  // (slots, 3, 3)
};

}  // namespace qlb
