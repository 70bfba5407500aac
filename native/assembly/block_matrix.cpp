#include "assembly/block_matrix.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

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

void BlockMatrix::check_stencils(std::span<const std::int32_t> nodes) const {
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (nodes[k] < 0 || nodes[k] >= pattern_->nodes())
      throw std::out_of_range("stencil " + std::to_string(k / 4) + " has a node outside [0, " +
                              std::to_string(pattern_->nodes()) + ")");
}

void BlockMatrix::add_stencils(std::span<const std::int32_t> nodes, const double* blocks) {
  check_stencils(nodes);
  for (std::size_t first = 0; first < nodes.size(); first += 4, blocks += 144)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const std::int32_t i = nodes[first + a], j = nodes[first + b];
        if (i < j) continue;  // its transpose stands for it
        double* to = values() + 9 * pattern_->find(i, j);
        const double* from = blocks + 36 * a + 3 * b;
        for (int c = 0; c < 3; ++c)
          for (int d = 0; d < 3; ++d) to[3 * c + d] += from[12 * c + d];
      }
}

void BlockMatrix::add_rank_one(std::span<const std::int32_t> nodes, const double* vectors, const double* stiffness,
                               std::span<const std::uint8_t> left_out) {
  check_stencils(nodes);
  for (std::size_t first = 0; first < nodes.size(); first += 4, vectors += 12, ++stiffness)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const std::int32_t i = nodes[first + a], j = nodes[first + b];
        if (i < j || left_out[i] || left_out[j]) continue;
        double* to = values() + 9 * pattern_->find(i, j);
        for (int c = 0; c < 3; ++c)
          for (int d = 0; d < 3; ++d) to[3 * c + d] += *stiffness * vectors[3 * a + c] * vectors[3 * b + d];
      }
}

void BlockMatrix::set_from(const PatternMap& map, const BlockMatrix& other) {
  if (&map.outer() != pattern_.get() || &map.inner() != other.pattern_.get())
    throw std::invalid_argument("the map belongs to other patterns than those of the matrices");
  double* end = values();  // of what is set
  for (const PatternMap::Run& run : map.runs()) {
    std::fill(end, values() + 9 * run.outer, 0.0);
    end = std::copy_n(other.values() + 9 * run.inner, 9 * run.count, values() + 9 * run.outer);
  }
  std::fill(end, values() + values_.size(), 0.0);
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
