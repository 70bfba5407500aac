#include "assembly/block_matrix.hpp"

#include <algorithm>

namespace qlb {

void BlockMatrix::set_zero(int threads) {
  const auto size = static_cast<std::int64_t>(values_.size());
#pragma omp parallel for schedule(static) num_threads(threads)
  for (std::int64_t k = 0; k < size; ++k) values_[k] = 0.0;
}

void BlockMatrix::shift_diagonal(double amount) {
  for (std::int64_t j = 0; j < pattern_->nodes(); ++j) {
    double* block = values() + 9 * pattern_->column_begin()[j];
    for (int a = 0; a < 3; ++a) block[4 * a] += amount;
  }
}

void BlockMatrix::multiply(const double* x, double* out) const {
  std::fill(out, out + 3 * pattern_->nodes(), 0.0);
  for (std::int64_t j = 0; j < pattern_->nodes(); ++j)
    for (std::int64_t k = pattern_->column_begin()[j]; k < pattern_->column_begin()[j + 1]; ++k) {
      const std::int64_t i = pattern_->rows()[k];
      const double* block = values() + 9 * k;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          out[3 * i + a] += block[3 * a + b] * x[3 * j + b];
          if (i != j) out[3 * j + b] += block[3 * a + b] * x[3 * i + a];
        }
    }
}

}  // namespace qlb
