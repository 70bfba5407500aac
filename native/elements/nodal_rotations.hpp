// The rotation of the material at each node between two configurations: R_i is the polar factor of
// sum_e vol_e F_e(x) F_e(reference)^T over the elements at node i.
#pragma once

#include <memory>

#include "elements/kernels.hpp"
#include "elements/tet_blocks.hpp"

namespace qlb {

class NodalRotations {
 public:
  NodalRotations(std::shared_ptr<const TetBlocks> blocks, int threads);

  // rotations (nodes, 3, 3), row by row
  void compute(const double* x, const double* reference, double* rotations);

  std::int64_t nodes() const { return blocks_->nodes; }

 private:
  std::shared_ptr<const TetBlocks> blocks_;
  const GeometryKernels* kernels_;
  int threads_;
  Aligned<double> positions_;  // (2, slots, kStride)
  Aligned<double> slot_sums_;  // (slots, 3, 3)
};

}  // namespace qlb
