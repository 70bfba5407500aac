// B^-1 carried along with the material: T B^-1 T^T, T block-diagonal with a map for each node
// (TetGeometry::nodal_maps).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "elements/tet_geometry.hpp"
#include "linalg/cholesky.hpp"

namespace qlb {

class CarriedInverse : public InverseOperator {
 public:
  // fixed: (nodes, 3); a node with a held axis keeps T = 1, so that what is held stays held.
  CarriedInverse(std::shared_ptr<InverseOperator> inner, std::shared_ptr<const TetBlocks> blocks,
                 std::span<const std::uint8_t> fixed, int threads);

  // T from how the material has moved between `reference`, where B was taken, and x.
  void carry(const double* x, const double* reference, double weight);
  // T = 1
  void reset() { carried_ = false; }

  std::int64_t size() const override { return inner_->size(); }
  void apply(const double* b, double* x) override;

 private:
  std::shared_ptr<InverseOperator> inner_;
  TetGeometry geometry_;
  std::vector<std::int64_t> held_nodes_;
  int threads_;
  bool carried_ = false;
  Aligned<double> maps_;  // (nodes, 3, 3)
  Aligned<double> right_, solution_;
};

}  // namespace qlb
