// B^-1 carried along with the material: R B^-1 R^T, R block-diagonal with a rotation for each node.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "elements/tet_geometry.hpp"
#include "linalg/cholesky.hpp"

namespace qlb {

class RotatedInverse : public InverseOperator {
 public:
  // fixed: (nodes, 3); a node with a held axis keeps R = 1, so that what is held stays held.
  RotatedInverse(std::shared_ptr<InverseOperator> inner, std::shared_ptr<const TetBlocks> blocks,
                 std::span<const std::uint8_t> fixed, int threads);

  // R from the rotation of the material between `reference`, where B was taken, and x.
  void turn(const double* x, const double* reference);
  // R = 1
  void reset() { turned_ = false; }

  std::int64_t size() const override { return inner_->size(); }
  void apply(const double* b, double* x) override;

 private:
  std::shared_ptr<InverseOperator> inner_;
  TetGeometry geometry_;
  std::vector<std::int64_t> held_nodes_;
  int threads_;
  bool turned_ = false;
  Aligned<double> rotations_;  // (nodes, 3, 3)
  Aligned<double> right_, solution_;
};

}  // namespace qlb
