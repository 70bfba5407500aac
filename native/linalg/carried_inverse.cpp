#include "linalg/carried_inverse.hpp"

#include <stdexcept>

namespace qlb {

CarriedInverse::CarriedInverse(std::shared_ptr<InverseOperator> inner, std::shared_ptr<const TetBlocks> blocks,
                               std::span<const std::uint8_t> fixed, int threads)
    : inner_(std::move(inner)), geometry_(std::move(blocks), threads), threads_(threads) {
  if (static_cast<std::int64_t>(fixed.size()) != size() || 3 * geometry_.nodes() != size())
    throw std::invalid_argument("fixed must have one entry per degree of freedom of the inverse");
  for (std::int64_t i = 0; i < geometry_.nodes(); ++i)
    if (fixed[3 * i] || fixed[3 * i + 1] || fixed[3 * i + 2]) held_nodes_.push_back(i);
  maps_.resize(3 * size());
  right_.resize(size());
  solution_.resize(size());
}

void CarriedInverse::carry(const double* x, const double* reference, double weight) {
  geometry_.nodal_maps(x, reference, weight, maps_.data());
  for (const std::int64_t i : held_nodes_)
    for (int k = 0; k < 9; ++k) maps_[9 * i + k] = k % 4 == 0 ? 1.0 : 0.0;
  carried_ = true;
}

void CarriedInverse::apply(const double* b, double* x) {
  if (!carried_) return inner_->apply(b, x);
  const std::int64_t nodes = geometry_.nodes();
#pragma omp parallel for schedule(static) num_threads(threads_) if (nodes > 16384)
  for (std::int64_t i = 0; i < nodes; ++i) {
    const double *T = &maps_[9 * i], *v = b + 3 * i;
    for (int k = 0; k < 3; ++k) right_[3 * i + k] = T[k] * v[0] + T[3 + k] * v[1] + T[6 + k] * v[2];
  }
  inner_->apply(right_.data(), solution_.data());
#pragma omp parallel for schedule(static) num_threads(threads_) if (nodes > 16384)
  for (std::int64_t i = 0; i < nodes; ++i) {
    const double *T = &maps_[9 * i], *v = &solution_[3 * i];
    for (int k = 0; k < 3; ++k) x[3 * i + k] = T[3 * k] * v[0] + T[3 * k + 1] * v[1] + T[3 * k + 2] * v[2];
  }
}

}  // namespace qlb
