// B^-1 carried along with the material: T B^-1 T^T, T as in MaterialFrame.
#pragma once

#include <memory>
#include <span>

#include "linalg/cholesky.hpp"
#include "linalg/material_frame.hpp"

namespace qlb {

class CarriedInverse : public InverseOperator {
 public:
  // fixed: (nodes, 3); a node with a held axis keeps T = 1, so that what is held stays held.
  CarriedInverse(std::shared_ptr<InverseOperator> inner, std::shared_ptr<const TetBlocks> blocks,
                 std::span<const std::uint8_t> fixed, int threads);

  // T from how the material has moved between `reference`, where B was taken, and x.
  void carry(const double* x, const double* reference, double weight) { frame_.carry(x, reference, weight); }
  // T = 1
  void reset() { frame_.reset(); }

  std::int64_t size() const override { return inner_->size(); }
  void apply(const double* b, double* x) override;

 private:
  std::shared_ptr<InverseOperator> inner_;
  MaterialFrame frame_;
  Aligned<double> right_, solution_;
};

}  // namespace qlb
