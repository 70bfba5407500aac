// 1/2 |x - target|_M^2 for a mass matrix M (x) I3 given by its node entries: diagonal (lumped) or consistent.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "assembly/block_matrix.hpp"

namespace qlb {

class Inertia {
 public:
  // The node mass matrix [kg] in compressed sparse rows, symmetric, both triangles.
  Inertia(std::span<const std::int64_t> row_begin, std::span<const std::int32_t> columns,
          std::span<const double> values, std::shared_ptr<const BlockPattern> pattern, int threads);

  // Returns scale/2 |x - target|_M^2 and adds scale M (x - target) to gradient.
  double add_value_gradient(const double* x, const double* target, double scale, double* gradient);
  void add_hessian(double scale, BlockMatrix& matrix) const;

 private:
  std::int64_t nodes_;
  std::vector<std::int64_t> row_begin_;
  std::vector<std::int32_t> column_;
  std::vector<double> mass_;
  std::vector<std::int64_t> block_;  // block of each entry of the lower triangle, else -1
  std::vector<double> partial_;
  int threads_;
};

}  // namespace qlb
