#include "linalg/carried_inverse.hpp"

#include <stdexcept>

namespace qlb {

CarriedInverse::CarriedInverse(std::shared_ptr<InverseOperator> inner, std::shared_ptr<const TetBlocks> blocks,
                               std::span<const std::uint8_t> fixed, int threads)
    : inner_(std::move(inner)), frame_(std::move(blocks), fixed, threads) {
  if (3 * frame_.nodes() != size()) throw std::invalid_argument("the mesh and the inverse differ in size");
  right_.resize(size());
  solution_.resize(size());
}

void CarriedInverse::apply(const double* b, double* x) {
  if (!frame_.carried()) return inner_->apply(b, x);
  frame_.pull_back(b, right_.data());
  inner_->apply(right_.data(), solution_.data());
  frame_.push_forward(solution_.data(), x);
}

}  // namespace qlb
