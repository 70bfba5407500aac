// A symmetric matrix of 3x3 node blocks over a BlockPattern.
#pragma once

#include <memory>

#include "assembly/block_pattern.hpp"
#include "assembly/pattern_map.hpp"
#include "simd/aligned.hpp"

namespace qlb {

class BlockMatrix {
 public:
  explicit BlockMatrix(std::shared_ptr<const BlockPattern> pattern)
      : pattern_(std::move(pattern)), values_(9 * pattern_->blocks(), 0.0) {}

  const BlockPattern& pattern() const { return *pattern_; }
  std::shared_ptr<const BlockPattern> shared_pattern() const { return pattern_; }
  double* values() { return values_.data(); }  // (blocks, 3, 3), row by row; diagonal blocks are filled whole
  const double* values() const { return values_.data(); }

  void set_zero(int threads);
  void shift_diagonal(double amount);
  // Adds symmetric matrices between up to four nodes: nodes (count, 4), blocks (count, 12, 12). A node that is repeated
  // takes the sum of its rows and columns. Throws std::out_of_range where the pattern lacks a pair.
  void add_stencils(std::span<const std::int32_t> nodes, const double* blocks);
  // Adds stiffness_j a_j a_j^T, a_j with a vector for each of up to four nodes, nodes (count, 4), vectors (count, 4,
  // 3); `left_out` (nodes of the pattern): nonzero where vectors count as zero. Throws as add_stencils.
  void add_rank_one(std::span<const std::int32_t> nodes, const double* vectors, const double* stiffness,
                    std::span<const std::uint8_t> left_out);
  // What `other` holds, over the inner pattern of the map, and zero elsewhere.
  void set_from(const PatternMap& map, const BlockMatrix& other);
  // out = A x, both (nodes, 3)
  void multiply(const double* x, double* out) const;

 private:
  void check_stencils(std::span<const std::int32_t> nodes) const;

  std::shared_ptr<const BlockPattern> pattern_;
  Aligned<double> values_;
};

}  // namespace qlb
