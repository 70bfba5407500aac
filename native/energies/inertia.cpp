#include "energies/inertia.hpp"

#include <algorithm>
#include <numeric>

namespace qlb {
namespace {
constexpr std::int64_t kRows = 1024;  // rows summed together: the grouping never depends on the threads
}

Inertia::Inertia(std::span<const std::int64_t> row_begin, std::span<const std::int32_t> columns,
                 std::span<const double> values, std::shared_ptr<const BlockPattern> pattern, int threads)
    : nodes_(static_cast<std::int64_t>(row_begin.size()) - 1),
      row_begin_(row_begin.begin(), row_begin.end()),
      column_(columns.begin(), columns.end()),
      mass_(values.begin(), values.end()),
      partial_((nodes_ + kRows - 1) / kRows),
      threads_(threads) {
  block_.reserve(column_.size());
  for (std::int32_t i = 0; i < nodes_; ++i)
    for (std::int64_t k = row_begin_[i]; k < row_begin_[i + 1]; ++k)
      block_.push_back(column_[k] <= i ? pattern->find(i, column_[k]) : -1);
}

double Inertia::add_value_gradient(const double* x, const double* target, double scale, double* gradient) {
  const auto groups = static_cast<std::int64_t>(partial_.size());
#pragma omp parallel for schedule(static) num_threads(threads_) if (groups > 8)
  for (std::int64_t group = 0; group < groups; ++group) {
    double sum = 0.0;
    for (std::int64_t i = group * kRows; i < std::min(nodes_, (group + 1) * kRows); ++i) {
      double Mr[3] = {};
      for (std::int64_t k = row_begin_[i]; k < row_begin_[i + 1]; ++k) {
        const std::int64_t j = 3 * static_cast<std::int64_t>(column_[k]);
        for (int c = 0; c < 3; ++c) Mr[c] += mass_[k] * (x[j + c] - target[j + c]);
      }
      for (int c = 0; c < 3; ++c) {
        sum += (x[3 * i + c] - target[3 * i + c]) * Mr[c];
        gradient[3 * i + c] += scale * Mr[c];
      }
    }
    partial_[group] = sum;
  }
  return 0.5 * scale * std::accumulate(partial_.begin(), partial_.end(), 0.0);
}

void Inertia::add_hessian(double scale, BlockMatrix& matrix) const {
  for (std::size_t k = 0; k < block_.size(); ++k) {
    if (block_[k] < 0) continue;
    double* block = matrix.values() + 9 * block_[k];
    for (int c = 0; c < 3; ++c) block[4 * c] += scale * mass_[k];
  }
}

}  // namespace qlb
